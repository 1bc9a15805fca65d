"""Several inputs and outputs: matrices of responses, their modes, and their changes."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
