"""What a Python session uses first: a run to look at, an experiment to design, an example to try.

The names are those of `livebode` itself, which loads each module when its name is first used: a run needs no
simulation.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
