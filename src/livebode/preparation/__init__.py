"""From a configuration and a recording to a tracker: roles, automatic values, transients, hum."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
