"""The command line."""

import os

# Before NumPy is loaded: the matrices here are so small that BLAS threads only wait for each other, on a busy machine
# ten times as long as the product takes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from livebode.cli.start import main

__all__ = ["main"]
