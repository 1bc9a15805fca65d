"""Points of a signal or a spectrum for a plot: few, but each extreme value remains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

POINTS_MAX = 1500
COLUMNS = POINTS_MAX // 3
_LEVELS_MIN = 16  # a signal with fewer values is quantised: its highest value is no limit
_FLAT_MIN = 3

Indices = NDArray[np.int64]


def extremes(x: NDArray[np.float64]) -> Indices:
    """Indices of at most 1,500 samples, in order.

    All of them, or of each of at most 500 columns the lowest and the highest value and the first that is not finite.

    >>> extremes(np.array([1.0, 2.0])).tolist()
    [0, 1]
    """
    n = len(x)
    if n <= POINTS_MAX:
        return np.arange(n)
    width = -(-n // COLUMNS)
    used = -(-n // width)
    cells = np.append(x, np.full(used * width - n, x[-1])).reshape(used, width)
    first = np.arange(used) * width
    known = np.isfinite(cells)
    if known.all():
        places = [cells.argmin(axis=1), cells.argmax(axis=1)]
    else:
        places = [
            np.where(known, cells, np.inf).argmin(axis=1),
            np.where(known, cells, -np.inf).argmax(axis=1),
            known.argmin(axis=1),
        ]
    return np.unique(np.minimum(np.concatenate([first + place for place in places]), n - 1))


def columns_of(amplitude: NDArray[np.float64], *, logarithmic: bool) -> tuple[Indices, NDArray[np.float64]]:
    """Index of the largest amplitude in each of at most 1,500 columns, and the smallest amplitude there.

    The columns have equal widths in frequency, or, from bin 1, in the logarithm of the frequency.
    """
    bins = np.arange(1, len(amplitude))
    if len(bins) <= POINTS_MAX:
        return bins, amplitude[bins]
    place = np.log(bins) if logarithmic else bins.astype(float)
    column = ((place - place[0]) / (place[-1] - place[0]) * (POINTS_MAX - 1)).astype(np.int64)
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    inner = amplitude[bins]
    high = np.maximum.reduceat(inner, starts)
    largest = np.flatnonzero(inner == np.repeat(high, np.diff(starts, append=len(bins))))
    _, first = np.unique(column[largest], return_index=True)
    return bins[largest[first]], np.minimum.reduceat(inner, starts)


@dataclass(frozen=True)
class Remark:
    """What is conspicuous in a signal.

    Attributes
    ----------
    missing
        Samples that are missing or not a number.
    constant
        Whether all others are equal.
    limit, limited
        Highest or lowest value at which the signal is cut off, and the number of samples there; None and 0 without.
    """

    missing: int
    constant: bool
    limit: float | None
    limited: int


def remark_of(x: NDArray[np.float64]) -> Remark:
    """What a person should know about these samples.

    A signal counts as cut off if it has its highest (lowest) value in at least 3 samples in a row, and arrives there
    in steps of more than twice its smallest one: a quantised signal at its turning point arrives in the smallest step.

    >>> remark_of(np.minimum(np.sin(np.arange(400) / 10), 0.9)).limit
    0.9
    """
    finite = np.isfinite(x)
    known = x if finite.all() else x[finite]
    missing = len(x) - len(known)
    if not known.size:
        return Remark(missing, constant=False, limit=None, limited=0)
    low, high = float(known.min()), float(known.max())
    if low == high:
        return Remark(missing, constant=len(known) > 1, limit=None, limited=0)
    counts = {value: _cut_off(known, value) for value in (high, low)}
    limit = max(counts, key=lambda value: counts[value])
    limited = counts[limit]
    if limited and len(np.unique(known)) <= _LEVELS_MIN:
        limited = 0
    return Remark(missing, constant=False, limit=limit if limited else None, limited=limited)


def _cut_off(x: NDArray[np.float64], value: float) -> int:
    """Samples in flat pieces at this value whose edges are steep."""
    at = np.flatnonzero(x == value)
    if len(at) < _FLAT_MIN:
        return 0
    breaks = np.flatnonzero(np.diff(at) > 1)
    starts, stops = at[np.append(0, breaks + 1)], at[np.append(breaks, -1)] + 1
    flat = stops - starts >= _FLAT_MIN
    starts, stops = starts[flat], stops[flat]
    if not starts.size:
        return 0
    step = np.abs(np.diff(x))
    smallest = step[step > 0].min()
    before, after = np.abs(x[np.maximum(starts - 1, 0)] - value), np.abs(x[np.minimum(stops, len(x) - 1)] - value)
    steep = np.maximum(before, after) > 2 * smallest
    return int((stops - starts)[steep].sum())
