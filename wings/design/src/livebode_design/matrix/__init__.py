"""The design for a machine with several motors."""
