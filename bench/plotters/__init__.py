"""Plotting libraries for the dashboard, compared for the page of a hall."""
