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
        "band-invalid": "The limits of the band are not two frequencies above 0, the lower one first.",
        "band-too-narrow": "The band has too few lines of the grid for this excitation.",
        "band-without-line": "The band has no line of the grid.",
        "line-at-edge": "A line is too near to 0 or to the Nyquist frequency for the Hann window.",
        "line-off": "A frequency is not a line of the grid, or was not measured.",
        "lines-too-close": "Two lines are too near to each other for the Hann window.",
        "not-alike": "Responses on different lines were to be combined.",
        "too-few-detection-lines": "The lines leave too few bins without excitation to estimate the noise from.",
        "too-many-lines": "The band has more lines than one experiment may have.",
        "window-missing": "Lines counted in bins need a window.",
        "window-too-long": "The period is longer than the longest window.",
    }
