"""The newest samples of some signals, in the order of time."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase


class NewestSamples(StatefulBase):
    """A ring of the newest samples of `signals` signals. `count` is the number since the last start."""

    _stage = Stage("newest-samples", 1)
    _STATE = ("_ring", "_at", "count")

    def __init__(self, signals: int, size: int) -> None:
        self._ring = np.zeros((signals, size))
        self._at = self.count = 0

    def add(self, data: Floats) -> None:
        """Add samples, shape (signals, samples)."""
        size, samples = self._ring.shape[1], data.shape[1]
        data = data[:, -size:]
        start = (self._at + samples - data.shape[1]) % size
        first = min(size - start, data.shape[1])
        self._ring[:, start : start + first] = data[:, :first]
        self._ring[:, : data.shape[1] - first] = data[:, first:]
        self._at = (self._at + samples) % size
        self.count += samples

    @property
    def window(self) -> Floats:
        """The newest samples, the oldest first, shape (signals, size)."""
        return np.concatenate([self._ring[:, self._at :], self._ring[:, : self._at]], axis=1)
