"""Mains hum: tones at multiples of 50 or 60 Hz that repeat with the window, as the excitation does."""

from __future__ import annotations

from functools import lru_cache
from math import gcd

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import MAINS_HZ, Lines

_ON_BIN = 0.1  # bins: a tone this close to a bin has nearly all its power there
HARMONICS = 10
_BESIDE = np.array([-4, -3, -2, -1, 1, 2, 3, 4])
_CHANCE = 1e-8  # of noise alone to be taken for a tone: (1 + r/n)^-n for a power of r times the mean of n neighbours

_MATTERS = 1e-8
"""Share of the strongest line's power: hum below a ten-thousandth of the response, and rounding, do not matter."""


class Mains:
    """Which lines are at multiples of a mains frequency, and whether the mains is seen at other multiples of it.

    A tone on a line cannot be separated from the response at that line. It is detected by harmonics on bins without
    excitation, or in a period without excitation. A permanent tone at one line only cannot be detected in a periodic
    recording.

    Attributes
    ----------
    lines
        Which lines are at a multiple of each mains frequency, shape (frequencies, lines).
    bins
        The bins whose power is needed, ascending; empty where no line is at a multiple.
    """

    def __init__(self, lines: Lines) -> None:
        bins, highest = np.asarray(lines.bins), (lines.window - 1) // 2
        self.lines = np.zeros((len(MAINS_HZ), len(bins)), dtype=np.bool_)
        free = []
        for i, mains_hz in enumerate(MAINS_HZ):
            self.lines[i] = np.isin(bins, _on_bins(mains_hz, lines, highest))
            tones = np.setdiff1d(_on_bins(mains_hz, lines, HARMONICS), bins)
            free.append(tones if self.lines[i].any() else tones[:0])
        self._any = np.asarray(self.lines.any(axis=0))
        # Distortion is at multiples of the lines' common divisor, and of odd lines at odd or at even ones alone:
        # at these distances it is like that at the harmonic.
        distances = _BESIDE * int(np.lcm(2, gcd(*lines.bins)))
        barred = np.concatenate([bins, *free])
        self.free = [Neighbours(tones, distances, barred, highest) for tones in free]
        barred = np.concatenate(free)
        self.excited = Neighbours(bins if self._any.any() else bins[:0], 2 * _BESIDE, barred, highest)
        groups = [*self.free, self.excited]
        self.bins = np.unique(np.concatenate([group.bins for group in groups]))
        for group in groups:
            group.place_in(self.bins)

    @property
    def any(self) -> bool:
        return bool(self._any.any())

    def seen(self, output: Floats) -> NDArray[np.bool_]:
        """Lines that may contain hum, (rows, lines), by the power of the mean output at `bins`, (rows, bins)."""
        if not self.any:
            return np.zeros((len(output), self._any.size), dtype=np.bool_)
        least = _MATTERS * output[:, self.excited.tones].max(axis=1, keepdims=True)
        stands_out = [(group.stand_out(output) & (output[:, group.tones] > least)).any(axis=1) for group in self.free]
        return np.asarray((self.lines & np.array(stands_out).T[:, :, np.newaxis]).any(axis=1))

    def alone(self, output: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """In a period without excitation: the power at each line, and whether it is that of a tone there.

        `output` is the power at `bins`; shapes (lines,).
        """
        if not self.any:
            return np.zeros(self._any.size), self._any
        return output[self.excited.tones], self._any & self.excited.stand_out(output)


@lru_cache(maxsize=64)
def mains_of(lines: Lines) -> Mains:
    """The Mains of these lines; several trackers of the same lines have the same one."""
    return Mains(lines)


class Neighbours:
    """Bins at which a tone may be, and the neighbours with which each is compared."""

    def __init__(
        self, tones: NDArray[np.int64], distances: NDArray[np.int64], barred: NDArray[np.int64], highest: int
    ) -> None:
        beside = tones[:, np.newaxis] + distances
        self.usable = (beside > 0) & (beside <= highest) & ~np.isin(beside, barred)
        self.tones, self.beside = tones, beside.clip(0, highest)
        count = self.usable.sum(axis=1)
        self.known = np.maximum(count, 1).astype(np.float64)
        self.enough = count >= distances.size // 2
        self.times = np.array([prominence(n) for n in count])

    @property
    def bins(self) -> NDArray[np.int64]:
        return np.concatenate([self.tones, self.beside.ravel()])

    def place_in(self, bins: NDArray[np.int64]) -> None:
        """Restrict the powers to these bins."""
        self.tones, self.beside = np.searchsorted(bins, self.tones), np.searchsorted(bins, self.beside)

    def stand_out(self, power: Floats) -> NDArray[np.bool_]:
        """Bins whose power exceeds that of their neighbours by more than chance, (…, bins) to (…, tones)."""
        level = np.where(self.usable, np.take(power, self.beside, axis=-1), 0.0).sum(axis=-1) / self.known
        return np.asarray(self.enough & (power[..., self.tones] > self.times * level))


def prominence(neighbours: int) -> float:
    """Ratio to the mean power of its neighbours that a bin of noise exceeds with a probability of 1e-8."""
    return float(neighbours * (_CHANCE ** (-1 / max(neighbours, 1)) - 1))


def _on_bins(mains_hz: float, lines: Lines, harmonics: int) -> NDArray[np.int64]:
    """Bins at multiples of the mains frequency."""
    exact = mains_hz * np.arange(1, harmonics + 1) / lines.resolution_hz
    near = np.rint(exact).astype(np.int64)
    return np.asarray(near[(np.abs(exact - near) < _ON_BIN) & (near > 0) & (2 * near < lines.window)])
