"""Several inputs and outputs: excitations that separate the inputs, and their design; the loop, the mean matrix."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
