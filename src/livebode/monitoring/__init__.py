"""Learns a baseline of the healthy machine and raises an alarm when the machine changes."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
