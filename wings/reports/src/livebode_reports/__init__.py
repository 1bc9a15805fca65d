"""Reports of one run and comparisons of two, as HTML and PDF."""
