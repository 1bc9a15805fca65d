"""Loop check, tuning, friction and orders of a run."""
