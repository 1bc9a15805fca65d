"""Simulated tooth-belt axis with known truth (Nevaranta 2016)."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
