"""Finite samples so large that they would corrupt a running sum: broken telegrams, not measurements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import Stage, StatefulBase

Floats = NDArray[np.float64]

# Against a sample this much larger, 16 digits leave 8 for everything else until the kernel renews its sums.
_FACTOR = 1e8


class PlausibleRange(StatefulBase):
    """Finds samples more than 1e8 times larger than any sample of the same signal in the whole period before."""

    _stage = Stage("plausible-range", 1)
    _STATE = ("_largest", "_limit", "_at")

    def __init__(self, signals: int, window: int) -> None:
        self._window = window
        self._largest = np.zeros(signals)
        self._limit = np.full(signals, np.inf)
        self._at = 0

    def process(self, data: Floats) -> NDArray[np.intp]:
        """Positions in `data` (channels, samples), all finite, of samples that are too large in any channel."""
        size = np.abs(data)
        starts = np.r_[0, np.arange(self._window - self._at, size.shape[1], self._window)]
        found: list[NDArray[np.intp]] = []
        for i, largest in enumerate(np.maximum.reduceat(size, starts, axis=1).T):
            if i > 0:
                self._end_period()
            if np.any(largest > self._limit):
                piece = size[:, starts[i] : starts[i + 1] if i + 1 < starts.size else None]
                wrong = piece > self._limit[:, np.newaxis]
                found.append(starts[i] + np.flatnonzero(wrong.any(axis=0)))
                largest = np.max(piece, axis=1, where=~wrong, initial=0.0)
            self._largest = np.maximum(self._largest, largest)
        self._at = (self._at + size.shape[1]) % self._window
        if self._at == 0:
            self._end_period()
        return np.concatenate(found) if found else np.zeros(0, dtype=np.intp)

    def _end_period(self) -> None:
        # A signal that was zero gives no scale for what is too large.
        self._limit = np.where(self._largest > 0, _FACTOR * self._largest, np.inf)
        self._largest = np.zeros_like(self._largest)
