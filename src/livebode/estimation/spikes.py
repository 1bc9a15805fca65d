"""Samples that differ strongly from the same place in previous periods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase

_COMPARED = 3  # the smallest number of periods whose median one spike cannot move
_REMEMBERED = 9  # periods whose largest differences define the usual difference
_FACTOR = 2.0  # a Gaussian sample of a window of 100 passes it once in 1e6 windows, and machines have heavier tails
_ROUNDING = 1e-9  # of the signal's size: smaller differences are rounding


class SpikeGate(StatefulBase):
    """Finds spikes in periodic signals sample by sample, without look-ahead.

    A sample is a spike when it differs from the median of the last three periods at its place by more than twice what
    the largest difference of a period usually is (median over the last nine periods). The largest and not a standard
    deviation, since measured currents have heavy tails that belong to every period. Nothing is found before two
    periods have been compared.

    Parameters
    ----------
    watched
        For each signal, whether it is checked.
    window
        Period, samples.
    """

    _stage = Stage("spike-gate", 1)
    _STATE = ("_past", "_largest", "_difference", "_size", "_limit", "_periods", "_at", "_whole")

    def __init__(self, watched: NDArray[np.bool_], window: int) -> None:
        self._watched = watched
        signals = int(watched.sum())
        self._past = np.zeros((_COMPARED, signals, window))
        self._largest = np.full((_REMEMBERED, signals), np.nan)
        self._difference = np.zeros(signals)
        self._size = np.zeros(signals)
        self._limit = np.full(signals, np.inf)
        self._periods = 0
        self._at = 0
        self._whole = True

    def restart(self, sample: int) -> None:
        """The next sample has this number; the previous periods remain the reference."""
        self._at = sample % self._past.shape[2]
        self._whole = self._at == 0

    def process(self, data: Floats) -> NDArray[np.intp]:
        """Positions in `data` (channels, samples) of samples that are spikes in any watched channel."""
        data = data[self._watched]
        spikes = np.zeros(data.shape[1], dtype=np.bool_)
        window = self._past.shape[2]
        done = 0
        while done < spikes.size:
            n = min(spikes.size - done, window - self._at)
            spikes[done : done + n] = self._within_period(data[:, done : done + n])
            done += n
            if self._at == window:
                self._end_period()
        return np.flatnonzero(spikes)

    def _within_period(self, data: Floats) -> NDArray[np.bool_]:
        places = slice(self._at, self._at + data.shape[1])
        self._at = places.stop
        known = min(self._periods, _COMPARED)
        expected = np.median(self._past[:known, :, places], axis=0) if known else data
        difference = np.abs(data - expected)
        spike = difference > self._limit[:, np.newaxis]
        self._difference = np.maximum(self._difference, difference.max(axis=1))
        self._size = np.maximum(self._size, np.abs(expected).max(axis=1))
        # A spike does not become part of the reference for later periods.
        self._past[self._periods % _COMPARED][:, places] = np.where(spike, expected, data)
        return np.asarray(spike.any(axis=0))

    def _end_period(self) -> None:
        # A period that began in the middle is not a reference; the next one overwrites it.
        if self._whole:
            if self._periods > 0:
                self._largest[self._periods % _REMEMBERED] = self._difference
            if self._periods > 1:
                usual = np.nanmedian(self._largest, axis=0)
                self._limit = np.maximum(_FACTOR * usual, _ROUNDING * self._size)
            self._periods += 1
        self._difference[:] = 0.0
        self._at = 0
        self._whole = True
