"""Trends in pictures and words, and the report of a hall."""
