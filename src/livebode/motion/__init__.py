"""Responses of an axis in motion, corrected by a model that follows the axis's motion."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
