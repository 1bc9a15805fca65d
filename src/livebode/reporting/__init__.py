"""The contents of the reports of one or two runs, as plain data; `livebode.pictures` lays them out."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
