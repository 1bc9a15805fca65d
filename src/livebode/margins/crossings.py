"""Where an open loop crosses what a margin is read from, for many rows at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.margins.open_loop import OpenLoop

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

BANDWIDTH = 10 ** (-3 / 20)
"""|T| at the bandwidth: 3 dB down."""

_TOLERANCE = 1e-10  # of a frequency


class Crossings(NamedTuple):
    """Places on the curves of some rows, all shape (places,)."""

    row: NDArray[np.int64]
    frequency_hz: Floats
    open_loop: Complex


Side = Callable[[Complex], Floats]


def gain_crossings(loop: OpenLoop, values: Floats, frequency_hz: Floats, grid: Complex) -> Crossings:
    """Where |L| = 1."""
    with np.errstate(divide="ignore"):  # a sampled loop may be nought at half the rate
        return _found(loop, values, frequency_hz, grid, lambda x: np.log(np.abs(x)))


def phase_crossings(loop: OpenLoop, values: Floats, frequency_hz: Floats, grid: Complex) -> Crossings:
    """Where L is a negative number; also half the rate, where a sampled loop is real, if it is negative there."""
    found = _found(loop, values, frequency_hz, grid, lambda x: np.asarray(x.imag), lambda x: x.real < 0)
    last = np.flatnonzero(grid[:, -1].real < 0)
    ends = Crossings(last, np.full(last.size, frequency_hz[-1]), grid[last, -1])
    return Crossings(*(np.concatenate(parts) for parts in zip(found, ends)))


def bandwidth_crossings(loop: OpenLoop, values: Floats, frequency_hz: Floats, grid: Complex) -> Crossings:
    """Where |T| = |L/(1 + L)| first falls 3 dB below one; none for a row whose |T| begins below."""
    closed = np.abs(grid / (1 + grid))
    below = closed < BANDWIDTH
    at = np.argmax(below, axis=1)
    row = np.flatnonzero((at > 0) & below[np.arange(len(grid)), at])
    return _between(loop, values, frequency_hz, row, at[row] - 1, lambda x: np.log(np.abs(x / (1 + x)) / BANDWIDTH))


def nearest_to_minus_one(loop: OpenLoop, values: Floats, frequency_hz: Floats, grid: Complex) -> Crossings:
    """Where |1 + L| is least in each row."""
    from scipy.optimize import elementwise

    row = np.arange(len(grid))
    at = np.argmin(np.abs(1 + grid), axis=1)
    found = Crossings(row, frequency_hz[at], grid[row, at])
    inside = np.flatnonzero((at > 0) & (at < len(frequency_hz) - 1))
    if not inside.size:
        return found
    log = np.log(frequency_hz)
    bracket = tuple(log[at[inside] + step] for step in (-1, 0, 1))

    def distance(x: Floats, i: Any) -> Floats:
        return np.log(np.abs(1 + _one(loop, values, np.exp(x), i.astype(np.int64))))

    better = elementwise.find_minimum(distance, bracket, args=(inside.astype(float),), tolerances={"xatol": 1e-7})
    frequency = found.frequency_hz.copy()
    frequency[inside] = np.exp(better.x)
    return Crossings(row, frequency, _one(loop, values, frequency, row))


def _found(
    loop: OpenLoop,
    values: Floats,
    frequency_hz: Floats,
    grid: Complex,
    side: Side,
    counts: Callable[[Complex], NDArray[np.bool_]] | None = None,
) -> Crossings:
    """Every place where `side` changes its sign and `counts` holds."""
    sign = side(grid) > 0
    row, at = np.nonzero(sign[:, 1:] != sign[:, :-1])
    if counts is not None:
        # At half the rate L is real but for rounding; its sign there says nothing, and the end is counted by itself.
        kept = counts(grid[row, at]) & (at < len(frequency_hz) - 2)
        row, at = row[kept], at[kept]
    return _between(loop, values, frequency_hz, row, at, side)


def _between(
    loop: OpenLoop, values: Floats, frequency_hz: Floats, row: NDArray[np.int64], at: NDArray[np.int64], side: Side
) -> Crossings:
    """The roots of `side` between neighbours of the grid."""
    if not row.size:
        return Crossings(row, np.zeros(0), np.zeros(0, dtype=np.complex128))
    from scipy.optimize import elementwise

    def value(x: Floats, i: Any) -> Floats:
        return side(_one(loop, values, x, i.astype(np.int64)))

    ends = frequency_hz[at], frequency_hz[at + 1]
    root = elementwise.find_root(value, ends, args=(row.astype(float),), tolerances={"xrtol": _TOLERANCE})
    return Crossings(row, root.x, _one(loop, values, root.x, row))


def _one(loop: OpenLoop, values: Floats, frequency_hz: Floats, row: NDArray[np.int64]) -> Complex:
    """L of one row at one frequency each."""
    return loop.at(values[row], frequency_hz[:, np.newaxis])[:, 0]
