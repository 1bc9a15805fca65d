"""Whole periods of signals, cut from samples that come in any pieces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import StatefulBase

_TOGETHER = 1 << 15  # samples of a signal in one batch: a few of such signals, and their spectra, stay in the cache


@dataclass(frozen=True, eq=False)
class Periods:
    """Consecutive whole periods.

    Attributes
    ----------
    signals
        Shape (signals, periods, N).
    schedule
        Shape (periods, N); None where there is none.
    complete
        Whether no sample is missing or left out, shape (periods,).
    stop
        Index behind the last sample of the first period.
    """

    signals: Floats
    schedule: Floats | None
    complete: NDArray[np.bool_]
    stop: int


class PeriodCutter(StatefulBase):
    """Cuts signals at the multiples of N, and remembers the period that has begun.

    Parameters
    ----------
    window
        N, samples.
    differenced
        Which signals are differenced, shape (signals,).
    """

    _STATE: ClassVar[tuple[str, ...]] = ("_samples", "_position", "_at", "_whole")

    def __init__(self, window: int, differenced: NDArray[np.bool_]) -> None:
        self._window, self._differenced = window, differenced[:, np.newaxis]
        self._lead = int(differenced.any())  # samples before a period that are needed
        self._samples = np.zeros((differenced.size, window + 1))  # with the one before the period
        self._position = np.full(window, np.nan)
        self._at, self._whole = 0, False

    def _begin_at(self, sample: int) -> None:
        """The next sample has this number and does not follow the previous one."""
        self._at = sample % self._window
        self._whole, self._position[:] = False, np.nan

    def _cut(self, data: Floats, schedule: Floats | None, left_out: NDArray[np.int64]) -> Iterator[Periods]:
        """The periods that end in these samples, some at a time.

        Parameters
        ----------
        data, schedule
            Shapes (signals, samples) and (samples,); no schedule: None.
        left_out
            Indices of the samples without which a period does not count.
        """
        window, offset, samples = self._window, self._at, data.shape[1]
        count = (offset + samples) // window
        complete = np.ones(count + 1, dtype=np.bool_)
        complete[0] = self._whole
        if left_out.size:
            complete[(offset + left_out) // window] = False
        together = max(1, _TOGETHER // window)
        for first in range(0, count, together):
            last = min(count, first + together)
            begin, end = first * window - offset, last * window - offset
            signals, position = self._signals(data, begin, end), self._positions(schedule, begin, end)
            yield Periods(
                self._differences(signals).reshape(len(data), last - first, window),
                None if position is None else position.reshape(last - first, window),
                complete[first:last],
                begin + window,
            )
            if last == count:
                self._samples[:, 1:] = signals[:, -window:]
                self._samples[:, 0] = self._samples[:, -1]
                if position is not None:
                    self._position[:] = position[-window:]
        remainder, offset = (samples, offset) if not count else ((offset + samples) % window, 0)
        self._samples[:, offset + 1 : offset + 1 + remainder] = data[:, samples - remainder :]
        if schedule is not None:
            self._position[offset : offset + remainder] = schedule[samples - remainder :]
        self._at, self._whole = offset + remainder, bool(complete[count])

    def _signals(self, data: Floats, begin: int, end: int) -> Floats:
        """Samples from `begin` on, which may be before the data, with the one before them where it is needed."""
        first = begin - self._lead
        if first >= 0:
            return data[:, first:end]
        return np.concatenate([self._samples[:, 1 - self._lead : 1 - begin], data[:, :end]], axis=1)

    def _positions(self, schedule: Floats | None, begin: int, end: int) -> Floats | None:
        if schedule is None or begin >= 0:
            return schedule if schedule is None else schedule[begin:end]
        return np.concatenate([self._position[:-begin], schedule[:end]])

    def _differences(self, signals: Floats) -> Floats:
        """Signals without the sample before them, some of them differenced."""
        return np.where(self._differenced, np.diff(signals), signals[:, 1:]) if self._lead else signals
