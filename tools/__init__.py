"""Programs for those who work on livebode."""
