"""An excitation as a file for a drive, a PLC or another program."""

from livebode_design.files.formats import FORMATS, write

__all__ = ["FORMATS", "write"]
