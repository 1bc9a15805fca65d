"""Table: the healthy machine over a scheduling signal, without a model of it, and the rows of windows."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Parameters, Responses, RowArrays, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.monitoring.accuracy import ChangeAccuracy


@dataclass(frozen=True, eq=False)
class WindowRows(RowArrays):
    """One row for every window length, (rows, columns) for values.

    `variance` is the row's own estimate of E|error|²; `step` is the schedule's change since the previous row; `ok` is
    False where a row is not judged.
    """

    value: NDArray[np.complex128]
    variance: Floats
    schedule: Floats
    step: Floats
    time_s: Floats
    sample: NDArray[np.int64]
    ok: NDArray[np.bool_]


PLACES = 5
"""Number of places in the period that shows the effect of a window's place on a moving machine's response."""


def places(window: int, hop: int) -> tuple[int, ...]:
    """Places of rows in the period at this hop, in samples after its end; the first one is used for monitoring.

    In a window over which the machine moves, each line leaks into the others, with a phase that depends on where in
    the excitation's period the window begins; five places or more show how much. Every hop that divides the window
    has a row at the period's end; for any other hop the last row of a period is as near to the end as possible.

    >>> places(400, 20), places(400, 200), places(400, 400), places(400, 800), places(400, 89)
    ((0, 320, 240, 160, 80), (0, 200), (0,), (0,), (356, 267, 178, 89))
    """
    count = max(1, window // hop)
    return tuple(step * hop % window for step in range(count, 0, -max(1, count // PLACES))) if hop < window else (0,)


class NonOverlappingWindows(StatefulBase):
    """Selects rows whose windows do not overlap from a stream of responses or parameters.

    Parameters
    ----------
    apart
        Samples from row to row: a window, or the hop where that is longer.
    place
        One of `places`.
    """

    _stage = Stage("non-overlapping", 1)
    _STATE = ("_sample", "_schedule")

    def __init__(self, apart: int, place: int) -> None:
        self._apart, self._place = apart, place
        self._sample, self._schedule = -2 * apart, np.nan  # no row is so far after it

    def of_responses(self, responses: Responses) -> WindowRows:
        """Rows of complex values at the lines; of a machine that was not ready, none is judged."""
        use = self._chosen(responses.sample)
        ok = np.all(responses.valid[use] & np.isfinite(responses.sigma[use]), axis=1) & responses.ready[use]
        return self._rows(
            responses.value[use], responses.sigma[use] ** 2, responses.schedule[use], responses.time_s[use],
            responses.sample[use], ok,
        )  # fmt: skip

    def of_parameters(self, parameters: Parameters) -> WindowRows:
        """Rows of parameters."""
        use = self._chosen(parameters.sample)
        variance = np.einsum("rii->ri", parameters.covariance[use])
        return self._rows(
            parameters.value[use].astype(np.complex128), variance, parameters.schedule[use], parameters.time_s[use],
            parameters.sample[use], parameters.ok[use],
        )  # fmt: skip

    def takes(self, sample: NDArray[np.int64]) -> bool:
        """Whether any of these is a row; most batches of a live run have none."""
        return bool(((sample + 1) % self._apart == self._place).any())

    def _chosen(self, sample: NDArray[np.int64]) -> NDArray[np.intp]:
        return np.flatnonzero((sample + 1) % self._apart == self._place)

    def _rows(
        self, value: NDArray[np.complex128], variance: Floats, schedule: Floats, time_s: Floats,
        sample: NDArray[np.int64], ok: NDArray[np.bool_],
    ) -> WindowRows:  # fmt: skip
        before = np.concatenate([[self._schedule], schedule])
        follows = np.diff(np.concatenate([[self._sample], sample])) == self._apart
        if len(sample):
            self._sample, self._schedule = int(sample[-1]), float(schedule[-1])
        step = np.diff(before)
        known = (follows & np.isfinite(step)) | ~np.isfinite(schedule)
        return WindowRows(value, variance, schedule, np.where(follows, step, np.nan), time_s, sample, ok & known)


WAYS = 3
BACK, STILL, FORTH = range(WAYS)
"""Direction of the schedule: the values of a moving machine depend on it."""

FRICTION, ORDERS = SECTIONS = ("friction", "orders")
"""Tables whose rows are sections of motion; the others have windows."""
ALL = "all orders of the "
"""Begins the name of the component of a whole shaft."""

WINDOWS_MIN = 8
KNOWN = 4.0  # a change is at least this many standard deviations of the mean that it is compared with


@dataclass(frozen=True, eq=False)
class ScheduleTable:
    """Mean and covariance of rows of numbers in every bin of a schedule, by direction.

    A row is the result of a window: its response at the lines, or the parameters fitted to it. Deviations are
    relative to the mean, so that they are shares of a magnitude or of a parameter, and radians of a phase.

    Attributes
    ----------
    what
        "lines", "parameters", "friction" or "orders".
    names
        Of the columns, (columns,): "20 Hz", or the parameter.
    low, step
        Beginning of the first bin and width of a bin, in the schedule's unit; the step is 0 without a schedule.
    still
        A schedule that moves less than this from window to window is at standstill.
    mean
        (bins, ways, columns); complex for lines. NaN where nothing was learned.
    covariance
        Of the relative deviation, for lines of real and imaginary part (bins, ways, lines, 2, 2), for parameters
        (bins, ways, 1, parameters, parameters), for friction and orders the variances, (bins, ways, components, 1, 1).
    variance
        Mean of the rows' own estimates of their variance, relative, (bins, ways, columns).
    count
        Windows learned, (bins, ways).
    accuracy
        Of each component: real and imaginary part of each line, or each parameter.
    unit
        Of the amplitudes of orders.
    """

    what: str
    names: tuple[str, ...]
    low: float
    step: float
    still: float
    mean: NDArray[np.complex128]
    covariance: Floats
    variance: Floats
    count: NDArray[np.int64]
    accuracy: ChangeAccuracy
    unit: str = ""

    def place(self, rows: WindowRows) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Flat number of the cell (bin and direction) of each row, and whether the cell was learned."""
        cell, inside = cells(rows, self.low, self.step, self.still, len(self.count))
        return cell, inside & (self.count.ravel()[cell] >= WINDOWS_MIN)

    def deviation(self, rows: WindowRows, cell: NDArray[np.intp]) -> tuple[Floats, Floats]:
        """Relative deviation of every component, and its variance, (rows, components) each.

        Where a row's own estimate exceeds the learned variance, the excess is added.
        """
        deviation, own, more = self.deviation_parts(rows, cell)
        return deviation, own + more

    def deviation_parts(self, rows: WindowRows, cell: NDArray[np.intp]) -> tuple[Floats, Floats, Floats]:
        """Relative deviation, its learned variance, and the row's own excess over it, (rows, components) each.

        A mean of n windows has
        a variance/n of its own; a component of a cell whose mean is less accurate than the smallest change has an
        infinite variance, so that it has no weight.
        """
        cells = self.count.size
        mean, learned = self.mean.reshape(cells, -1)[cell], self.variance.reshape(cells, -1)[cell]
        with np.errstate(invalid="ignore", divide="ignore"):
            relative = rows.value / mean - 1
            more = np.maximum(rows.variance / np.abs(mean) ** 2 - learned, 0.0)
        if self.what == "lines":
            deviation = np.stack([relative.real, relative.imag], axis=2).reshape(len(rows), 2 * mean.shape[1])
            more = np.repeat(more / 2, 2, axis=1)
        else:
            deviation = relative.real
        own = np.where(np.isfinite(deviation + more), self._weighed[cell], np.inf)
        return deviation, own, np.nan_to_num(more)

    @property
    def components(self) -> tuple[str, ...]:
        """Name of each component: real and imaginary part of a line share it."""
        return tuple(name for name in self.names for _ in range(2 if self.what == "lines" else 1))

    @property
    def information(self) -> Floats:
        """Mean information of a learned row for a change of each component, (components,)."""
        weight = self.count.ravel() / self.count.sum()
        return np.asarray(weight @ np.nan_to_num(1 / self._weighed))

    @cached_property
    def _weighed(self) -> Floats:
        """Learned variance of a row in each cell, infinite where its mean is less accurate than the smallest change."""
        count = self.count.reshape(-1, 1)
        own = np.einsum("...ii->...i", self.covariance).reshape(count.size, -1)
        unknown = KNOWN**2 * own / np.maximum(count, 1) > self.accuracy.smallest**2
        return np.where(unknown, np.inf, own)


def cells(
    rows: WindowRows, low: float, step: float, still: float, bins: int
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Flat number of the cell of each row, and whether it is inside of the bins; without a schedule all are in one."""
    if step == 0:
        return np.full(len(rows), STILL, dtype=np.intp), np.ones(len(rows), dtype=bool)
    with np.errstate(invalid="ignore"):
        number = np.floor((rows.schedule - low) / step)
        way = np.where(rows.step > still, FORTH, np.where(rows.step < -still, BACK, STILL))
    inside = np.isfinite(number) & (number >= 0) & (number < bins) & np.isfinite(rows.step)
    return np.where(inside, number, 0).astype(np.intp) * WAYS + way, inside
