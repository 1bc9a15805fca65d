"""From healthy rows to a Table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import BaselineError
from livebode.monitoring.accuracy import STRETCH, ChangeAccuracy, accuracy
from livebode.monitoring.table import KNOWN, WAYS, WINDOWS_MIN, ScheduleTable, WindowRows, cells

_BINS = 24
_SMALLEST = 0.01  # of a magnitude or a parameter; radians of a phase
_ROUNDING = float(np.finfo(np.float32).eps)
_STILL = 0.05  # of the fastest usual step
_ENOUGH = 0.9  # of the cells are to be known well enough for the smallest change


def learn_table(quantity: str, names: Sequence[str], runs: Sequence[WindowRows], overlap: int = 1) -> ScheduleTable:
    """Mean and covariance in 24 bins of the schedule, by direction.

    The runs should contain the usual speeds, directions and temperatures. The correlation of consecutive windows and
    of whole stretches is learned too, and delays alarms accordingly. So is the difference between places of the
    period: `runs` may contain each recording `overlap` times, with rows at other places of the period. These overlap,
    and count as one.

    Raises
    ------
    BaselineError
        If there are too few rows, or no cell has enough of them.
    """
    windows = sum(int(rows.ok.sum()) for rows in runs) // overlap
    if windows < 3 * WINDOWS_MIN:
        raise BaselineError(
            "too-few-windows",
            f"the runs contain {windows} windows with valid {quantity} that do not overlap, less than the "
            f"{3 * WINDOWS_MIN} that a baseline needs",
            "give longer runs, or more of them",
            quantity=quantity,
            windows=windows,
            windows_min=3 * WINDOWS_MIN,
        )
    rows = WindowRows.join(runs)
    rows = rows[rows.ok]
    low, step, still, bins = _grid(rows)
    cell, inside = cells(rows, low, step, still, bins)
    rows, cell = rows[inside], cell[inside]
    table = _moments(quantity, tuple(names), (low, step, still), bins, rows, cell, overlap)
    if not np.any(table.count >= WINDOWS_MIN):
        raise BaselineError(
            "too-few-windows",
            f"a baseline needs {WINDOWS_MIN} windows of {quantity} in a bin of the schedule, and no bin has more than "
            f"{int(table.count.max())}",
            "give longer runs over the whole travel, or more of them",
            quantity=quantity,
            windows_min=WINDOWS_MIN,
        )
    table = replace(table, accuracy=replace(table.accuracy, smallest=_smallest(table)))
    deviation, variance = table.deviation(rows, cell)
    known = np.isfinite(variance)
    information = np.where(known, 1 / variance, 0.0)
    score = np.where(known, deviation, 0.0) * information
    off = _off(table, cell, information)
    return replace(table, accuracy=accuracy(score, information, table.accuracy.smallest, off))


def _grid(rows: WindowRows) -> tuple[float, float, float, int]:
    if not np.isfinite(rows.schedule).any():
        return 0.0, 0.0, 0.0, 1
    low, high = float(np.nanmin(rows.schedule)), float(np.nanmax(rows.schedule))
    moved = np.abs(rows.step[np.isfinite(rows.step)])
    still = _STILL * float(np.quantile(moved, 0.99)) if moved.size else 0.0
    # The ends are known as well as float32 gives them, and a position at an end belongs to its bin.
    margin = _ROUNDING * max(abs(low), abs(high))
    if high == low:
        step = max(abs(low), 1.0) * 1e-3
        return low - step / 2, step, still, 1
    return low - margin, (high - low + 2 * margin) / _BINS * (1 + 1e-9), still, _BINS


def _moments(
    quantity: str, names: tuple[str, ...], grid: tuple[float, float, float], bins: int, rows: WindowRows,
    cell: NDArray[np.intp], overlap: int,
) -> ScheduleTable:  # fmt: skip
    number, columns = bins * WAYS, rows.value.shape[1]
    lines = quantity == "lines"
    parts = (columns, 2) if lines else (1, columns)
    mean = np.full((number, columns), complex(np.nan, np.nan))
    covariance = np.full((number, parts[0], parts[1], parts[1]), np.nan)
    variance = np.full((number, columns), np.nan)
    count = np.rint(np.bincount(cell, minlength=number) / overlap).astype(np.int64)
    for i in np.flatnonzero(count >= WINDOWS_MIN):
        value = rows.value[cell == i]
        mean[i] = value.mean(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = value / mean[i] - 1
            variance[i] = np.mean(rows.variance[cell == i], axis=0) / np.abs(mean[i]) ** 2
        part = np.stack([relative.real, relative.imag], axis=2) if lines else relative.real[:, np.newaxis, :]
        covariance[i] = np.einsum("rgi,rgj->gij", part, part) / len(part) * count[i] / (count[i] - 1)
    components = 2 * columns if lines else columns
    return ScheduleTable(
        quantity,
        names,
        *grid,
        mean.reshape(bins, WAYS, columns),
        covariance.reshape(bins, WAYS, *covariance.shape[1:]),
        variance.reshape(bins, WAYS, columns),
        count.reshape(bins, WAYS),
        ChangeAccuracy(np.ones(components), np.zeros(components), np.full(components, _SMALLEST)),
    )


def _smallest(table: ScheduleTable) -> Floats:
    """The change that most cells can detect, at least a hundredth."""
    own = np.einsum("...ii->...i", table.covariance).reshape(table.count.size, -1)
    enough = table.count.ravel() >= WINDOWS_MIN
    known = KNOWN * np.sqrt(own[enough] / table.count.ravel()[enough, np.newaxis])
    return np.asarray(np.maximum(_SMALLEST, np.quantile(known, _ENOUGH, axis=0)))


def _off(table: ScheduleTable, cell: NDArray[np.intp], information: Floats) -> Floats:
    """Standard deviation of the sum of the means' own errors over a stretch of rows, (components,).

    The mean of n rows has an error of variance/n, the same in every row of its cell: a machine that remains in one cell
    shows it permanently, one that passes many cells shows their mean.
    """
    cells, count = table.count.size, table.count.ravel()[:, np.newaxis]
    own = np.einsum("...ii->...i", table.covariance).reshape(cells, -1) / np.maximum(count, 1)
    stretch = np.arange(len(cell)) // STRETCH
    pair, pair_of_row = np.unique(stretch * cells + cell, return_inverse=True)
    weight = np.stack([np.bincount(pair_of_row, column) for column in information.T], axis=1)
    error = np.where(weight > 0, weight**2 * own[pair % cells], 0.0)
    variance, total = (np.stack([np.bincount(pair // cells, c) for c in x.T], axis=1) for x in (error, weight))
    known = total > 0
    of_stretch = np.where(known, variance / np.where(known, total, 1.0) ** 2, 0.0)
    return np.asarray(np.sqrt(of_stretch.sum(axis=0) / np.maximum(known.sum(axis=0), 1)))
