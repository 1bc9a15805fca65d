"""livebode: the Bode plot of a machine while the machine works."""

from importlib.metadata import version

__version__ = version("livebode")
