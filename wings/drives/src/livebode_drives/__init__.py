"""Drives and PLCs: their recordings, their samples live, and function blocks for a PLC; a wing of livebode."""
