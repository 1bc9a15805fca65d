"""Margins of the loop around a fitted plant, with bounds, and filters that would widen them."""

from livebode.margins.margins import Margins, margins
from livebode.margins.open_loop import OpenLoop

__all__ = ["Margins", "OpenLoop", "margins"]
