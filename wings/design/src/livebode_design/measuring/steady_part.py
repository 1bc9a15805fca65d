"""The part of a recording in which the designed excitation was played, between its ramps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TOLERANCE = 0.01
"""Largest difference from the design, as a share of its peak: rounding and the text of a controller are less."""


def steady_part(played: NDArray[np.float64], period: NDArray[np.float64]) -> tuple[int, int]:
    """First sample of the longest span in which `played` repeats `period`, and the sample after it.

    Parameters
    ----------
    played
        The recorded excitation, shape (samples,), at least three periods.
    period
        One period of the design.

    Returns
    -------
    Both are 0 where the excitation was never played.

    Examples
    --------
    >>> period = np.array([1.0, -1.0, 0.5, -0.5])
    >>> steady_part(np.concatenate([[0.0, 0.1], np.tile(np.roll(period, 1), 5), [0.0]]), period)
    (2, 22)
    """
    window, count = period.size, played.size // period.size
    if count < 1:
        return 0, 0
    # The period in the middle is the one that is least likely to be in a ramp.
    middle = played[count // 2 * window :][:window]
    if middle.size < window:
        middle = played[:window]
    matched = np.fft.irfft(np.fft.rfft(middle) * np.conj(np.fft.rfft(period)), window)
    expected = np.roll(period, int(np.argmax(matched)))[np.arange(played.size) % window]
    same = np.abs(played - expected) <= TOLERANCE * np.max(np.abs(period))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]])))
    spans = edges.reshape(-1, 2)
    if not len(spans):
        return 0, 0
    first, last = spans[np.argmax(spans[:, 1] - spans[:, 0])]
    return int(first), int(last)
