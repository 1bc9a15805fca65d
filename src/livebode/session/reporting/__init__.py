"""What a report says of a run, or of two, as plain data: gathered here, laid out by `livebode.report`."""
