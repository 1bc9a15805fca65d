"""Programs for those who work on livebode, and what its tests, studies and benchmarks share."""
