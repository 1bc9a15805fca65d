"""Trend and repeated spikes: what a Tracker subtracts from signals before their DFT."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from livebode.arrays import Floats, Integers
from livebode.dataclass import dataclass

_POINTS = 4  # of a cubic


@dataclass(frozen=True, eq=False)
class TrendStretch:
    """Trend of consecutive samples, as values that follow each other by `step` samples from sample `first` on.

    `values` is (channels, values), with four values or more; the stretch ends with sample `stop` − 1.
    """

    first: int
    stop: int
    step: int
    values: Floats

    def at(self, samples: Floats) -> Floats:
        """The cubic through the four nearest values at these samples, (channels, samples)."""
        position = (samples - self.first) / self.step
        place = np.clip(position.astype(np.int64), 1, self.values.shape[1] - _POINTS + 1)
        t, v = position - place, self.values
        weights = (
            -t * (t - 1) * (t - 2) / 6,
            (t + 1) * (t - 1) * (t - 2) / 2,
            -(t + 1) * t * (t - 2) / 2,
            (t + 1) * t * (t - 1) / 6,
        )
        return np.asarray(sum(weight * v[:, place + number - 1] for number, weight in enumerate(weights)))


@dataclass(frozen=True, eq=False)
class SensorSpikes(ABC):
    """Spikes of a channel that are subtracted.

    Attributes
    ----------
    channel
        Its name.
    sizes
        What is subtracted, shape (spikes,).
    """

    channel: str
    sizes: Floats

    @property
    def largest(self) -> float:
        """Size of the largest one."""
        return float(np.abs(self.sizes).max())

    @abstractmethod
    def of(self, start: int, stop: int) -> Floats:
        """The spikes in the samples start … stop − 1, (samples,)."""

    @abstractmethod
    def shifted(self, samples: int) -> Self:
        """The spikes of a recording whose samples have numbers that are larger by so many."""


@dataclass(frozen=True, eq=False)
class RepeatedSpikes(SensorSpikes):
    """Spikes at the same places of every period.

    Attributes
    ----------
    places
        Numbers of the samples modulo the window, shape (spikes,).
    window
        Samples of a period.
    """

    places: Integers
    window: int

    def of(self, start: int, stop: int) -> Floats:
        period = np.zeros(self.window)
        period[self.places] = self.sizes
        return period[np.arange(start, stop) % self.window]

    def shifted(self, samples: int) -> Self:
        return replace(self, places=(self.places + samples) % self.window)


@dataclass(frozen=True, eq=False)
class TurningSpikes(SensorSpikes):
    """Spikes at any samples: their numbers, ascending, shape (spikes,)."""

    samples: Integers

    def of(self, start: int, stop: int) -> Floats:
        found, some = np.zeros(stop - start), slice(*np.searchsorted(self.samples, [start, stop]))
        found[self.samples[some] - start] = self.sizes[some]
        return found

    def shifted(self, samples: int) -> Self:
        return replace(self, samples=self.samples + samples)


@dataclass(frozen=True, eq=False)
class SignalTrend:
    """Trend of some channels over a recording.

    Attributes
    ----------
    channels
        Their names.
    stretches
        Ascending and apart; between them it is not known, and 0.
    """

    channels: tuple[str, ...]
    stretches: Sequence[TrendStretch] = ()

    def of(self, names: Sequence[str | None], start: int, stop: int) -> Floats:
        """Trend of these channels at the samples start … stop − 1, (channels, samples)."""
        known = np.zeros((len(self.channels) + 1, stop - start))
        begun = bisect_right(self.stretches, start, key=lambda stretch: stretch.stop)
        for stretch in self.stretches[begun:]:
            if stretch.first >= stop:
                break
            first, last = max(start, stretch.first), min(stop, stretch.stop)
            known[:-1, first - start : last - start] = stretch.at(np.arange(first, last, dtype=np.float64))
        rows = [self.channels.index(name) if name in self.channels else -1 for name in names]
        return np.asarray(known[rows])

    def shifted(self, samples: int) -> SignalTrend:
        """The trend of a recording whose samples have numbers that are larger by so many."""
        moved = [replace(one, first=one.first + samples, stop=one.stop + samples) for one in self.stretches]
        return SignalTrend(self.channels, moved)
