"""Hum of the mains: tones at multiples of 50 or 60 Hz that repeat with a window as the excitation does."""

from __future__ import annotations

from math import gcd

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import Lines

Floats = NDArray[np.float64]

MAINS_HZ = (50.0, 60.0)
_ON_BIN = 0.1  # bins: a tone this close to a bin has nearly all its power there
_HARMONICS = 10
_BESIDE = np.array([-4, -3, -2, -1, 1, 2, 3, 4])
_CHANCE = 1e-8  # of noise alone to be taken for a tone: (1 + r/n)^-n for a power of r times the mean of n neighbours

_MATTERS = 1e-8
"""Of the strongest line's power: hum below a ten-thousandth of the response, and rounding, do not matter."""


class Mains:
    """Which lines are at multiples of a mains frequency, and whether the mains is seen at other multiples of it.

    A tone on a line cannot be told from the response there. Harmonics on bins without excitation tell it, and so does
    a period without excitation. A tone at one line alone, always there, cannot be seen in a periodic recording.
    """

    def __init__(self, lines: Lines) -> None:
        at = np.asarray(lines.bins)
        self.lines = np.zeros((len(MAINS_HZ), len(at)), dtype=np.bool_)
        self._tones: list[NDArray[np.int64]] = []
        for i, mains_hz in enumerate(MAINS_HZ):
            self.lines[i] = np.isin(at, _on_bins(mains_hz, lines, (lines.window - 1) // 2))
            free = np.setdiff1d(_on_bins(mains_hz, lines, _HARMONICS), at)
            self._tones.append(free if self.lines[i].any() else free[:0])
        self._excited = at
        # Distortion is at multiples of the lines' common divisor, and of odd lines at odd or at even ones alone:
        # at these distances it is like that at the harmonic.
        self._beside = _BESIDE * int(np.lcm(2, gcd(*lines.bins)))
        self._highest = (lines.window - 1) // 2

    @property
    def any(self) -> bool:
        return bool(self.lines.any())

    def seen(self, output: Floats) -> NDArray[np.bool_]:
        """Which lines may hold hum, (lines,), by the power of the mean output at all bins from 0 on."""
        least = _MATTERS * output[self._excited].max()
        found = [
            self._stand_out(output, tones, self._excited, self._beside) & (output[tones] > least)
            for tones in self._tones
        ]
        return np.asarray(sum(self.lines[i] & bool(f.any()) for i, f in enumerate(found)) > 0)

    def seen_alone(self, output: Floats) -> NDArray[np.bool_]:
        """The same by a period without excitation, in which the lines themselves show it."""
        none = np.zeros(0, dtype=np.int64)
        return np.asarray(self.lines.any(axis=0) & self._stand_out(output, self._excited, none, 2 * _BESIDE))

    def _stand_out(
        self, output: Floats, tones: NDArray[np.int64], excited: NDArray[np.int64], distances: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        beside = tones[:, np.newaxis] + distances
        usable = (beside > 0) & (beside <= self._highest) & ~np.isin(beside, excited)
        usable &= ~np.isin(beside, np.concatenate(self._tones))
        power = np.where(usable, output[beside.clip(0, self._highest)], 0.0)
        count = usable.sum(axis=1)
        level = power.sum(axis=1) / np.maximum(count, 1)
        stands_out = count * (_CHANCE ** (-1 / np.maximum(count, 1)) - 1)
        return np.asarray((count >= len(_BESIDE) // 2) & (output[tones] > stands_out * level))


def _on_bins(mains_hz: float, lines: Lines, harmonics: int) -> NDArray[np.int64]:
    """Bins at multiples of the mains frequency."""
    exact = mains_hz * np.arange(1, harmonics + 1) / lines.resolution_hz
    near = np.rint(exact).astype(np.int64)
    return np.asarray(near[(np.abs(exact - near) < _ON_BIN) & (near > 0) & (2 * near < lines.window)])
