"""Margins of the loop of a run: the command, their picture and their section of the report."""
