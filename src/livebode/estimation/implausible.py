"""Finite samples so large that they would corrupt a running sum: broken telegrams, not measurements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase
from livebode.kernel import largest_sizes

# Against a sample this much larger, 16 digits leave 8 for everything else until the kernel renews its sums.
_FACTOR = 1e8
_NONE = np.zeros(0, dtype=np.intp)


class PlausibleRange(StatefulBase):
    """Finds samples more than 1e8 times larger than any sample of the same signal in the whole period before."""

    _stage = Stage("plausible-range", 1)
    _STATE = ("_largest", "_limit", "_at")

    def __init__(self, signals: int, window: int) -> None:
        self._window = window
        self._largest = np.zeros(signals)
        self._limit = np.full(signals, np.inf)
        self._at = 0

    def sizes(self, data: Floats) -> Floats:
        """Largest |x| in what remains of the period and in each after it, (channels, periods); NaN where one is."""
        return largest_sizes(data, self._window - self._at, self._window)

    def process(self, data: Floats, sizes: Floats | None = None) -> NDArray[np.intp]:
        """Positions in `data` (channels, samples), all finite, of samples that are too large in any channel.

        `sizes` are those of the same data, where they are known.
        """
        pieces = self._found(data, self.sizes(data) if sizes is None else sizes)
        self._at = (self._at + data.shape[1]) % self._window
        if self._at == 0:
            self._end_period()
        return np.concatenate(pieces) if pieces else _NONE

    @staticmethod
    def are_plausible(ranges: Sequence[PlausibleRange], size: Floats) -> tuple[NDArray[np.bool_], Floats]:
        """Which of the ranges find nothing in their next sample, of sizes (ranges, channels); for `take_each` the
        largest sizes of the period so far, same shape.

        No range changes.
        """
        every = np.maximum(np.array([own._largest for own in ranges]), size)
        limits = np.array([own._limit for own in ranges])
        return np.asarray(~(every > limits).any(axis=1)), every

    @staticmethod
    def process_each(ranges: Sequence[PlausibleRange], every: Floats) -> None:
        """Continue ranges of one length with a plausible sample each, as `process` would."""
        for own, largest, limit in zip(ranges, every, _limits(every)):
            own._at += 1
            if own._at == own._window:
                own._at = 0
                own._largest.fill(0.0)
                own._limit[:] = limit
            else:
                own._largest[:] = largest

    def _found(self, data: Floats, every: Floats) -> list[NDArray[np.intp]]:
        """Implausible samples, in pieces that begin a period, or continue the one that has begun."""
        every[:, 0] = np.maximum(self._largest, every[:, 0])
        limits = np.empty(every.shape)
        limits[:, 0], limits[:, 1:] = self._limit, _limits(every[:, :-1])
        if not (every > limits).any():  # nearly always
            self._largest, self._limit = every[:, -1].copy(), limits[:, -1].copy()
            return []
        pieces: list[NDArray[np.intp]] = []
        for i, largest in enumerate(every.T):
            if i > 0:
                self._end_period()
            if np.any(largest > self._limit):
                start = i * self._window - self._at
                piece = np.abs(data[:, max(start, 0) : start + self._window])
                wrong = piece > self._limit[:, np.newaxis]
                pieces.append(max(start, 0) + np.flatnonzero(wrong.any(axis=0)))
                largest = np.max(piece, axis=1, where=~wrong, initial=0.0)
            self._largest = np.maximum(self._largest, largest)
        return pieces

    def _end_period(self) -> None:
        self._limit = _limits(self._largest)
        self._largest = np.zeros_like(self._largest)


def _limits(largest: Floats) -> Floats:
    """Limits of the next period. A signal that was zero gives no scale for what is too large."""
    with np.errstate(over="ignore"):  # there is no larger number
        return np.where(largest > 0, _FACTOR * largest, np.inf)
