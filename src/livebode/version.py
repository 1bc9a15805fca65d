"""The version of livebode: a constant, because reading it from the installed metadata is slower than Python's start."""

__version__ = "0.1.0"
