"""A run for other programs: CSV, MATLAB, NetCDF, UFF 58, xarray and python-control."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
