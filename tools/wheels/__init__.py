"""Wheels: built for each Python of this computer, and tried in environments that contain nothing else."""
