"""From samples to frequency responses: the online tracker and the offline reference."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
