"""Live sources: buses, PLCs, servers and devices that send samples."""
