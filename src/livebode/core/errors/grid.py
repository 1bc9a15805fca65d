"""Frequencies that are not lines of a grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class GridError(LivebodeError):
    """A frequency is not a line of the grid, or data on different grids were to be combined."""

    area: ClassVar[str] = "grid"
    codes: ClassVar[Mapping[str, str]] = {
        "above-nyquist": "A frequency is not between 0 and half the rate.",
        "bin-not-sent": "A bin is needed that the drive does not send.",
        "bins-unordered": "The bins of spectra are not ascending.",
        "hop-off": "The hop of spectra neither divides the window nor is a multiple of it.",
        "line-duplicated": "A line is given more than once, or is both excited and quiet.",
        "line-off": "A frequency is not a line of the grid, or was not measured.",
        "no-common-line": "Two runs have no line in common.",
        "no-line": "There is no line at all.",
        "not-alike": "Responses on different lines, or of different quantities or units, were to be combined.",
        "window-out-of-range": "A window has too few or too many samples, or is not a whole number of them.",
    }
