"""Finished runs: averages, fits, loop report, comparison, validation, and the baseline learned from them."""
