"""Samples that are no measurements: implausible in size, or spikes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Stage, StatefulBase
from livebode.kernel import largest_sizes

FACTOR = 1e8
"""Against a sample this much larger, 16 digits leave 8 for everything else until the kernel renews its sums."""
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

    @property
    def newest(self) -> tuple[Floats, Floats, bool]:
        """For `process_newest`: largest sizes of the period, their limits, and whether the next sample ends it."""
        return self._largest, self._limit, self._at + 1 == self._window

    def count(self) -> None:
        """The next sample was added to the arrays of `newest`."""
        self._at = (self._at + 1) % self._window

    def _found(self, data: Floats, every: Floats) -> list[NDArray[np.intp]]:
        """Implausible samples, in pieces that begin a period, or continue the one that has begun."""
        every[:, 0] = np.maximum(self._largest, every[:, 0])
        limits = self._limit[:, np.newaxis]
        if every.shape[1] > 1:
            limits = np.concatenate([limits, _limits(every[:, :-1])], axis=1)
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
        return np.where(largest > 0, FACTOR * largest, np.inf)


_COMPARED = 3  # the smallest number of periods whose median one spike cannot move
_REMEMBERED = 9  # periods whose largest differences define the usual difference
_SPIKE_FACTOR = (
    2.0  # a Gaussian sample of a window of 100 passes it once in 1e6 windows, and machines have heavier tails
)
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
                self._limit = np.maximum(_SPIKE_FACTOR * usual, _ROUNDING * self._size)
            self._periods += 1
        self._difference[:] = 0.0
        self._at = 0
        self._whole = True
