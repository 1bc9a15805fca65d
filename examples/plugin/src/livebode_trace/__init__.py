"""Traces of a controller for livebode."""
