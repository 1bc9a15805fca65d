"""The page that shows a run while it is recorded, and afterwards (docs/how-to/dashboard.md)."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
