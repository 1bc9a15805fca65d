"""The crossings of an open loop from which margins are read, for many rows at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.analysis.open_loop import OpenLoop
from livebode.arrays import Complex, Floats

BANDWIDTH = 10 ** (-3 / 20)
"""|T| at the bandwidth: 3 dB down."""

_TOLERANCE, _WIDTH = 1e-10, 1e-5  # of a frequency
_STEPS_MAX = 200  # each halves a bracket: enough for any two numbers that are not 1e60 apart
_GOLDEN = (5**0.5 - 1) / 2

Function = Callable[[Floats], Floats]


class Crossings(NamedTuple):
    """Places on the curves of some rows, all shape (places,)."""

    row: NDArray[np.int64]
    frequency_hz: Floats
    open_loop: Complex


class CrossingKind(NamedTuple):
    """Function whose sign changes at a crossing, and which of the changes are used."""

    side: Callable[[Complex], Floats]
    counts: Callable[[Complex], NDArray[np.bool_]]


def _everywhere(value: Complex) -> NDArray[np.bool_]:
    return np.ones(value.shape, dtype=np.bool_)


GAIN = CrossingKind(lambda x: np.log(np.abs(x)), _everywhere)
PHASE = CrossingKind(lambda x: np.asarray(x.imag), lambda x: x.real < 0)
CLOSED = CrossingKind(lambda x: np.log(np.abs(x / (1 + x)) / BANDWIDTH), _everywhere)
_KINDS = (GAIN, PHASE, CLOSED)


def crossings(
    loop: OpenLoop, values: Floats, frequency_hz: Floats, grid: Complex
) -> tuple[Crossings, Crossings, Crossings]:
    """Where |L| = 1, where L is a negative number, and where |T| = |L/(1 + L)| first falls 3 dB below one.

    Half the rate, where a sampled loop is real, is a crossing of the second kind if L is negative there. A row whose
    |T| is below from the start has no bandwidth.
    """
    with np.errstate(divide="ignore"):  # a sampled loop may be zero at half the rate
        at_gain, at_phase = (_changes(grid, kind) for kind in (GAIN, PHASE))
    below = np.abs(grid / (1 + grid)) < BANDWIDTH
    first = np.argmax(below, axis=1)
    row = np.flatnonzero((first > 0) & below[np.arange(len(grid)), first])
    starts = [at_gain, at_phase, (row, first[row] - 1)]
    roots = _roots(loop, values, frequency_hz, starts)
    last = np.flatnonzero(grid[:, -1].real < 0)
    ends = Crossings(last, np.full(last.size, frequency_hz[-1]), grid[last, -1])
    phase = Crossings(*(np.concatenate(parts) for parts in zip(roots[1], ends)))
    return roots[0], phase, roots[2]


def nearest_to_minus_one(loop: OpenLoop, values: Floats, frequency_hz: Floats, grid: Complex) -> Crossings:
    """Where |1 + L| is least in each row."""
    row = np.arange(len(grid))
    index = np.argmin(np.abs(1 + grid), axis=1)
    nearest = Crossings(row, frequency_hz[index], grid[row, index])
    inside = np.flatnonzero((index > 0) & (index < len(frequency_hz) - 1))
    if not inside.size:
        return nearest
    log = np.log(frequency_hz)

    def distance(x: Floats) -> Floats:
        return np.abs(1 + _one(loop, values, np.exp(x), inside))

    frequency = nearest.frequency_hz.copy()
    frequency[inside] = np.exp(find_minima(distance, log[index[inside] - 1], log[index[inside] + 1], _WIDTH))
    return Crossings(row, frequency, _one(loop, values, frequency, row))


Starts = tuple[NDArray[np.int64], NDArray[np.int64]]


def _changes(grid: Complex, kind: CrossingKind) -> Starts:
    """Row and grid point before every change of sign that is used.

    At half the rate L is real except for rounding, so the sign there is meaningless.
    """
    sign = kind.side(grid) > 0
    row, point = np.nonzero(sign[:, 1:] != sign[:, :-1])
    kept = kind.counts(grid[row, point])
    if kind is PHASE:
        kept &= point < grid.shape[1] - 2
    return row[kept], point[kept]


def _roots(loop: OpenLoop, values: Floats, frequency_hz: Floats, starts: list[Starts]) -> list[Crossings]:
    """The roots between neighbours of the grid; all kinds at once, because the number of calls determines the time."""
    row, point = (np.concatenate(part) for part in zip(*starts))
    kind = np.repeat(np.arange(len(starts)), [len(r) for r, _ in starts])
    if not row.size:
        return [Crossings(row, np.zeros(0), np.zeros(0, dtype=np.complex128))] * len(starts)

    def value(x: Floats) -> Floats:
        open_loop = _one(loop, values, x, row)
        return np.asarray(np.choose(kind, [k.side(open_loop) for k in _KINDS]))

    root = find_roots(value, frequency_hz[point], frequency_hz[point + 1], _TOLERANCE)
    level = _one(loop, values, root, row)
    return [Crossings(row[of], root[of], level[of]) for of in (kind == i for i in range(len(starts)))]


def _one(loop: OpenLoop, values: Floats, frequency_hz: Floats, row: NDArray[np.int64]) -> Complex:
    """L of one row at one frequency each."""
    return loop.at(values[row], frequency_hz[:, np.newaxis])[:, 0]


def find_roots(function: Function, low: Floats, high: Floats, tolerance: float) -> Floats:
    """Roots of a function between ends of opposite signs, (rows,).

    Ridders' method (IEEE Trans. Circuits Syst. 26, 1979) halves the bracket in each step, and converges quadratically
    where the function is smooth. The value at an end may be infinite.

    Parameters
    ----------
    function
        Value of each row at one place each, (rows,) to (rows,).
    tolerance
        Of the root, relative.

    Examples
    --------
    >>> find_roots(lambda x: x**2 - np.array([2.0, 9.0]), np.array([1.0, 1.0]), np.array([2.0, 5.0]), 1e-12).round(9)
    array([1.41421356, 3.        ])
    """
    at_low, at_high = function(low), function(high)
    root = high
    with np.errstate(all="ignore"):
        for _ in range(_STEPS_MAX):
            middle = (low + high) / 2
            level = function(middle)
            step = (middle - low) * np.sign(at_low - at_high) * level / np.sqrt(level**2 - at_low * at_high)
            last, root = root, middle + np.where(np.isfinite(step), step, 0.0)
            value = function(root)
            for x, y in ((middle, level), (root, value)):
                inside = (x > low) & (x < high)
                below = inside & ((y > 0) == (at_low > 0))
                above = inside & ~below
                low, at_low = np.where(below, x, low), np.where(below, y, at_low)
                high, at_high = np.where(above, x, high), np.where(above, y, at_high)
            if ((np.abs(root - last) <= tolerance * np.abs(root)) | (value == 0)).all():
                break
    return root


def find_minima(function: Function, low: Floats, high: Floats, width: float) -> Floats:
    """Minima of a function between ends, (rows,), by golden sections to this width, and then by a parabola.

    The parabola is more accurate than any section: near a minimum values differ by rounding only.

    Examples
    --------
    >>> find_minima(lambda x: (x - np.array([0.2, 0.7])) ** 2, np.zeros(2), np.ones(2), 1e-4).round(8)
    array([0.2, 0.7])
    """
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    while (high - low).max(initial=0.0) > width:
        lower = at_left < at_right
        low, high = np.where(lower, low, left), np.where(lower, right, high)
        new = np.where(lower, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        value = function(new)
        left, right = np.where(lower, new, right), np.where(lower, left, new)
        at_left, at_right = np.where(lower, value, at_right), np.where(lower, at_left, value)
    middle, quarter = (low + high) / 2, (high - low) / 4
    before, between, after = (function(x) for x in (low, middle, high))
    bend = before - 2 * between + after
    share = np.divide(before - after, bend, out=np.zeros_like(bend), where=bend > 0).clip(-2, 2)
    return np.asarray(middle + quarter * share)
