"""Events and results of runs, sent to other systems: the [[publish]] sections of a configuration.

The kinds of receivers are those of plug-ins, as the wing `connect`; this is what they use.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
