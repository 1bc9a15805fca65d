"""The types that all other packages use: samples, lines, responses, loops, events, errors."""

import logging

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)

# Here because every module that logs uses this package, and `livebode --version` does not.
logging.getLogger("livebode").addHandler(logging.NullHandler())
