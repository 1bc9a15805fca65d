"""Stepped sines: one line after the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import WINDOW_MAX, GridError, Lines, UsageError, counted
from livebode.excitation._multisine import each, multisine


def stepped_sine(lines: Lines, amplitude: ArrayLike = 1.0, *, periods: int = 4) -> Floats:
    """Every line alone for `periods` windows, one after the other, shape (lines·periods·window,).

    A step is a whole number of periods that begins and ends at zero, so the signal has no jump. The sequence as a whole
    also repeats: over the long window of `stepped_lines` each line is on the grid, with 1/lines of its amplitude. All
    the power is in one line at a time, at a crest factor of √2 within a step; a changing machine is measured by each
    line at another time.

    Raises
    ------
    LivebodeError
        If `periods` is below 1, or the sequence is longer than the longest window.

    Examples
    --------
    >>> lines = Lines.parse("20:60:20", rate_hz=4000, window=200)
    >>> len(stepped_sine(lines, periods=2)), stepped_lines(lines, periods=2).bins
    (1200, (6, 12, 18))
    """
    stepped_lines(lines, periods=periods)
    sizes = each(amplitude, len(lines), "amplitude")
    steps = [multisine(Lines((k,), lines.window, lines.rate_hz), a, [0.0]) for k, a in zip(lines.bins, sizes)]
    return np.concatenate([np.tile(step, periods) for step in steps])


def stepped_lines(lines: Lines, *, periods: int = 4) -> Lines:
    """Lines of these frequencies on the grid of the whole sequence."""
    if periods < 1:
        raise UsageError(
            "out-of-range",
            f"{periods=} is below 1",
            "let each line last at least one window",
            argument="periods",
            value=periods,
            low=1,
        )
    times = len(lines) * periods
    if times * lines.window > WINDOW_MAX:
        most = WINDOW_MAX // (lines.window * len(lines))
        fits = f"at most {counted(most, 'period')}" if most else f"{WINDOW_MAX // lines.window} lines or fewer"
        raise GridError(
            "window-too-long",
            f"{counted(len(lines), 'step')} of {counted(periods, 'window')} of {lines.window} "
            f"samples are longer than the longest window {WINDOW_MAX}",
            f"take {fits}",
            window=times * lines.window,
            window_max=WINDOW_MAX,
        )
    return Lines(tuple(k * times for k in lines.bins), lines.window * times, lines.rate_hz)
