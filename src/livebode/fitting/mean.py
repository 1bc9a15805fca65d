"""The mean of many responses, with its bounds from their scatter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import InputError, Responses


def mean_response(responses: Responses) -> Responses:
    """Mean of the valid responses at each line, as a batch of one.

    Windows that overlap count once: m windows that would fit side by side into the run make m − 1 degrees of freedom,
    and sigma² is the scatter of the responses over m. With fewer than two such windows sigma is the least of them.
    `RunningMean` takes a run in parts.

    Bias: a machine that changes from response to response is averaged, and its change is in sigma. Of an estimate that
    averages over its periods already (`average`), take the newest response instead.

    Raises
    ------
    InputError
        If no line is ever valid.
    """
    running = RunningMean()
    running.add(responses)
    return running.response()


class RunningMean:
    """`mean_response` of a run that comes in parts, of which none is kept."""

    _first: NDArray[np.int64]
    _count: NDArray[np.int64]
    _coherent: NDArray[np.int64]
    _value: NDArray[np.complex128]
    _rest: NDArray[np.float64]
    _single: NDArray[np.float64]
    _coherence: NDArray[np.float64]
    _dof: float
    _time_s: float
    _schedule: float

    def __init__(self) -> None:
        self._last: Responses | None = None
        self._step: float | None = None
        self._rows = 0

    def add(self, responses: Responses) -> None:
        """More responses of the same run, in order."""
        use = responses.valid & np.isfinite(responses.value)
        rows = np.flatnonzero(use.any(axis=1))
        if not rows.size:
            return
        if self._last is None:
            self._begin(responses, int(rows[0]))
        if self._step is None and rows.size > 1:
            self._step = float(np.median(np.diff(responses.sample[rows])))
        count = np.count_nonzero(use, axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            value = np.where(count > 0, np.where(use, responses.value, 0).sum(axis=0) / count, 0)
            rest = np.where(use, np.abs(responses.value - value) ** 2, 0.0).sum(axis=0)
            single = np.min(np.where(use & np.isfinite(responses.sigma), responses.sigma, np.inf), axis=0)
            together = np.maximum(self._count + count, 1)
            apart = np.where((self._count > 0) & (count > 0), value - self._value, 0)
            fresh = self._count == 0
            self._value = np.where(fresh, value, self._value + apart * count / together)
            self._rest += rest + np.abs(apart) ** 2 * self._count * count / together
        self._single = np.minimum(self._single, single)
        coherent = use & np.isfinite(responses.coherence)
        self._coherent += np.count_nonzero(coherent, axis=0)
        self._coherence += np.where(coherent, responses.coherence, 0.0).sum(axis=0)
        self._count = self._count + count
        self._dof = max(self._dof, float(np.max(responses.dof[rows])))
        self._time_s += float(responses.time_s[rows].sum())
        self._schedule += float(responses.schedule[rows].sum())
        self._rows += rows.size
        self._last = responses[rows[-1:]]

    def _begin(self, responses: Responses, row: int) -> None:
        n = len(responses.lines)
        self._first = responses.first[row : row + 1]
        self._count, self._coherent = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self._value, self._rest = np.zeros(n, dtype=np.complex128), np.zeros(n)
        self._single, self._coherence = np.full(n, np.inf), np.zeros(n)
        self._dof, self._time_s, self._schedule = -np.inf, 0.0, 0.0

    @property
    def rows(self) -> int:
        """How many responses went in, with any line."""
        return self._rows

    def response(self) -> Responses:
        """The mean of what came so far; InputError where no line was ever valid."""
        last = self._last
        if last is None:
            raise InputError("none of the responses is valid at any line; there is nothing to fit")
        count = self._count
        share = min(1.0, (self._step or last.lines.window) / last.lines.window)
        with np.errstate(invalid="ignore", divide="ignore"):
            windows = count * share
            scatter = np.sqrt(self._rest / count / (windows - 1))
            several = windows >= 2
            sigma = np.where(several, scatter, np.where(np.isfinite(self._single), self._single, np.nan))
            value = np.where(count > 0, self._value, np.nan)
            coherence = np.where(self._coherent > 0, self._coherence / self._coherent, np.nan)
        dof = float(windows[several].min() - 1) if several.any() else self._dof
        return Responses(
            lines=last.lines,
            value=value[np.newaxis],
            sigma=sigma[np.newaxis],
            dof=np.array([dof]),
            coherence=coherence[np.newaxis],
            valid=(count > 0)[np.newaxis],
            first=self._first,
            sample=last.sample,
            time_s=np.array([self._time_s / self._rows]),
            schedule=np.array([self._schedule / self._rows]),
            quantity=last.quantity,
            unit=last.unit,
        )
