"""Controllers and input shapers proposed for a run, and how they are shown."""
