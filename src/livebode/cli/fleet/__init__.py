"""`livebode fleet`: the axes of many machines together."""
