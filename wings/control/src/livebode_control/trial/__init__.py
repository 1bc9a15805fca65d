"""Gains and filters that a person tries on the page of a run."""
