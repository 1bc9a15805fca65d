"""Frequencies that are not lines of a grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class GridError(LivebodeError):
    """A frequency is not a line of the grid, or data on different grids were to be combined.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.Lines.parse("25", rate_hz=4000, window=400)
    ... except livebode.GridError as error:
    ...     print(error.code)
    grid.line-off
    """

    area: ClassVar[str] = "grid"
    codes: ClassVar[Mapping[str, str]] = {
        "above-nyquist": "A frequency is not between 0 and half the rate.",
        "band-invalid": "The limits of the band are not two frequencies above 0, the lower one first.",
        "band-too-narrow": "The band has too few lines of the grid for this excitation.",
        "band-without-line": "The band has no line of the grid.",
        "bin-not-sent": "A bin is needed that the drive does not send.",
        "bins-unordered": "The bins of spectra are not ascending.",
        "hop-off": "The hop of spectra neither divides the window nor is a multiple of it.",
        "line-at-edge": "A line is too near to 0 or to the Nyquist frequency for the Hann window.",
        "line-duplicated": "A line is given more than once, or is both excited and quiet.",
        "line-off": "A frequency is not a line of the grid, or was not measured.",
        "lines-too-close": "Two lines are too near to each other for the Hann window.",
        "no-common-line": "Two runs have no line in common.",
        "no-line": "There is no line at all.",
        "not-alike": "Responses on different lines, or of different quantities or units, were to be combined.",
        "too-few-detection-lines": "The lines leave too few bins without excitation to estimate the noise from.",
        "too-many-lines": "The band has more lines than one experiment may have.",
        "window-missing": "Lines counted in bins need a window.",
        "window-out-of-range": "A window has too few or too many samples, or is not a whole number of them.",
        "window-too-long": "The period is longer than the longest window.",
    }
