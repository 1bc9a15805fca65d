"""Measure: play an excitation on a controller, watch its limits, and record what it does."""
