"""An excitation as a file that a drive, a PLC or another program takes."""

from livebode.design.files.formats import FORMATS, write

__all__ = ["FORMATS", "write"]
