"""From responses to models of the machine: physical parameters and rational models, with covariance."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
