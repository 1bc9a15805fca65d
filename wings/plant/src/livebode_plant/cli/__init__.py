"""`livebode archive` and `livebode fleet`."""
