"""The command line, and what the commands of a plug-in share with livebode's own."""

import os

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)

# Before NumPy is loaded: the matrices here are so small that BLAS threads only wait for each other, on a busy machine
# ten times as long as the product takes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
