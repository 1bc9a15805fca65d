"""InputAmplitude: how strongly the learned runs were excited, and how far a window is beyond it."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.monitoring.accuracy import STRETCH

STRONGER = 1.25
"""Excess from which on the excitation is another than the learned one."""

_WEAKEST = 0.1  # of the strongest line: noise and motion dominate lines below it


@dataclass(frozen=True, eq=False)
class InputAmplitude:
    """Root mean square of the input at each line in the learned windows, in the input's unit, (lines,) each.

    Attributes
    ----------
    rms
        Of all windows.
    low, high
        Smallest and largest of stretches of 24 windows.
    """

    rms: Floats
    low: Floats
    high: Floats

    @classmethod
    def unlimited(cls, lines: int) -> InputAmplitude:
        """Amplitude of runs for which it is not known yet."""
        return cls(np.zeros(lines), np.zeros(lines), np.full(lines, np.inf))

    @classmethod
    def of(cls, amplitude: Floats) -> InputAmplitude:
        """From the root mean square of healthy windows in order, (windows, lines)."""
        power = amplitude**2
        stretches = np.sqrt([part.mean(axis=0) for part in np.array_split(power, max(1, len(power) // STRETCH))])
        return cls(np.sqrt(power.mean(axis=0)), stretches.min(axis=0), stretches.max(axis=0))

    def excess(self, amplitude: Floats) -> Floats:
        """Largest ratio to the strongest learned stretch, at least 1, (windows, lines) in, (windows,)."""
        high = np.maximum(self.high, _WEAKEST * self.high.max())
        return np.asarray(np.maximum(np.max(amplitude / high, axis=1), 1.0))
