"""What a Python session uses first: a run to look at, an experiment to design, an example to try.

The names are those of `livebode` itself, which loads each module when its name is first used: a run needs no
simulation.
"""
