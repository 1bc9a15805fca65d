"""From a configuration and a recording to a tracker: roles, automatic values, transients, hum."""
