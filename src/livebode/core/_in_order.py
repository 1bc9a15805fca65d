"""What is kept of rows that come in order: the same for any way in which they are cut into parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats

_MOVED = 1e-3  # of the largest value of the schedule


def with_extremes(extremes: Floats, values: Floats) -> Floats:
    """Smallest and largest value so far; NaN without one."""
    return np.array([np.fmin(extremes[0], np.fmin.reduce(values)), np.fmax(extremes[1], np.fmax.reduce(values))])


def has_moved(extremes: Floats) -> bool:
    """Whether a schedule with these extremes varies by more than a thousandth."""
    low, high = extremes
    return bool(high - low > _MOVED * max(abs(low), abs(high)))


def added(sums: NDArray[Any], rows: NDArray[Any]) -> NDArray[Any]:
    """Sums and rows, (…, rows, lines), added one after the other: as if they came one by one, to the bit."""
    return np.asarray(np.cumsum(np.concatenate([sums[..., np.newaxis, :], rows], axis=-2), axis=-2)[..., -1, :])
