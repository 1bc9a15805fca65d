"""Events and results of runs, sent to other systems: the [[publish]] sections of a configuration."""
