"""Recordings of drives, PLCs, buses and robots."""
