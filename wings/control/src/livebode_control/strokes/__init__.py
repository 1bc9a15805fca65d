"""Friction and orders from strokes without excitation."""
