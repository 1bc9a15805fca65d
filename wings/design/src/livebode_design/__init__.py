"""The design of an excitation within the limits of a machine, and the measurement with it.

A controller that `livebode measure` plays on is a `Player` in the table of the kinds of live sources.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
