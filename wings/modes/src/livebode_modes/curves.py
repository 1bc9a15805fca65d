"""ModeCurve: one mode or harmonic over time, for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from livebode.arrays import Floats


@dataclass(frozen=True, eq=False)
class ModeCurve:
    """Frequency and damping of a mode over time; NaN where it was not found.

    Attributes
    ----------
    name
        Such as "mode 1" or "harmonic 1".
    time_s, frequency_hz, frequency_sigma, damping, damping_sigma
        (rows,) each; the damping of a harmonic is NaN.
    """

    name: str
    time_s: Floats
    frequency_hz: Floats
    frequency_sigma: Floats
    damping: Floats
    damping_sigma: Floats

    @property
    def harmonic(self) -> bool:
        return self.name.startswith("harmonic")

    @property
    def found(self) -> int:
        """Number of rows with values."""
        return int(np.count_nonzero(np.isfinite(self.frequency_hz)))
