"""The command line."""

import os

# Before NumPy is loaded: products as small as ours only make BLAS's threads wait for each other, on a busy machine for
# ten times as long as the product takes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from livebode.cli.app import app, main

__all__ = ["app", "main"]
