"""From nothing to a Bode plot in the browser: the start page of a directory of runs."""
