"""Stretches of samples that are set aside: windows with them are estimated, but nothing is learned from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Integers

NOTHING: Integers = np.zeros((0, 2), dtype=np.int64)
"""No stretch is set aside."""


def contains(spans: Integers, first: Integers, last: Integers) -> NDArray[np.bool_]:
    """Which of the windows first … last contain a sample of a span, shape of `first`.

    Parameters
    ----------
    spans
        First sample of each stretch, and the one after its last, shape (spans, 2), ascending and apart.

    Examples
    --------
    >>> contains(np.array([[10, 12]]), np.array([5, 6, 11, 12]), np.array([9, 10, 15, 16])).tolist()
    [False, True, True, False]
    """
    begins = np.append(spans[:, 0], np.iinfo(np.int64).max)
    return np.asarray(begins[np.searchsorted(spans[:, 1], first, side="right")] <= last)


def positions(spans: Integers, start: int, stop: int) -> NDArray[np.intp]:
    """Positions of their samples among the samples start … stop − 1."""
    every = np.arange(start, stop if len(spans) else start)
    return np.flatnonzero(contains(spans, every, every))
