"""The configuration of an axis: axis.toml, its validation, and the configuration that a run recorded."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
