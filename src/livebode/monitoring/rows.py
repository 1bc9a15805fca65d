"""Rows: values of windows that do not overlap, either responses or fitted parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Parameters, Responses, RowArrays, Stage, StatefulBase


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
