"""The commands report and compare."""
