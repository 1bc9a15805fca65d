"""Fitted models tested on data that they were not fitted to."""
