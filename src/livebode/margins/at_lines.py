"""Sensitivity of the loop at the lines, without a model."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import Loop, Responses


def peak_sensitivity_at_lines(responses: Responses, loop: Loop, c: float = 2.0) -> tuple[Floats, Floats, Floats]:
    """The largest |S| at a valid line: a lower bound for Ms, the only margin that lines give without a model.

    Between lines a loop can come nearer to −1 unnoticed, so no crossing is read from them.

    Parameters
    ----------
    responses
        Of the plant; shapes (rows, lines).
    loop
        The loop with its feedback.
    c
        For the bound: the truth at that line is in it with probability 1 − exp(−c²).

    Returns
    -------
    The largest |S| = 1/|1 + F·G|, its bound by dS/dG = −F·S², and the line's frequency, Hz; each (rows,), NaN where
    no line is valid.

    Examples
    --------
    >>> from livebode import PID, Lines
    >>> lines, ones = Lines.parse("20:60:20", 4000, 200), np.ones((1, 3))
    >>> row, value = np.zeros(1, dtype=int), np.array([[1.0, -0.5, -0.1]], dtype=complex)
    >>> measured = Responses(lines, value, 0.01 * ones, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)
    >>> found = peak_sensitivity_at_lines(measured, Loop(feedback=PID(gain=1.0, rate_hz=4000)))
    >>> [x.round(3).item() for x in found]
    [2.0, 0.08, 40.0]
    """
    f = responses.lines.frequency_hz
    behind = loop.feedback_at(f)
    with np.errstate(invalid="ignore", divide="ignore"):  # of invalid lines
        sensitivity = 1 / (1 + responses.value * behind)
    size = np.where(responses.valid, np.abs(sensitivity), -np.inf)
    at = np.argmax(size, axis=1)
    row = np.arange(len(size))
    known = np.isfinite(size[row, at])
    bound = responses.bound(c) * np.abs(behind * sensitivity**2)
    return tuple(np.where(known, x, np.nan) for x in (size[row, at], bound[row, at], f[at]))  # type: ignore[return-value]
