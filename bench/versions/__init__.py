"""Speed of two versions of livebode, measured alternately."""
