"""Accuracy of each line, and the recording time that it needs."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, log, sqrt

import numpy as np

from livebode.arrays import Floats
from livebode.core import UsageError
from livebode.excitation import Waveform
from livebode_design.machine import Machine

HOLDING_95 = sqrt(log(20))
"""Sigmas of a bound that covers 95 % of complex errors: 1 − exp(−c²) = 0.95."""


@dataclass(frozen=True, eq=False)
class LineAccuracy:
    """Standard deviation due to noise at each line of one window; shapes (lines,).

    Attributes
    ----------
    sigma
        Of the plant's response, E|Ĝ − G|² = sigma², at the place where it is largest relative to |G|.
    relative
        That sigma over |G| there.
    """

    sigma: Floats
    relative: Floats

    def windows(self, accuracy: float) -> int:
        """Windows to average until every line's 95 % bound is within `accuracy` times |G|; at least 1."""
        if not (np.isfinite(accuracy) and accuracy > 0):
            raise UsageError(
                "out-of-range",
                f"{accuracy=} is not a number above 0",
                "specify it as a fraction of |G|, such as 0.05 for 5 %",
                argument="accuracy",
                value=accuracy,
            )
        return max(1, ceil((HOLDING_95 * float(self.relative.max()) / accuracy) ** 2 - 1e-9))

    def reached(self, windows: int) -> Floats:
        """The 95 % bound of each line after this number of windows, as a share of |G|."""
        return np.asarray(HOLDING_95 * self.relative / sqrt(windows))

    def factor_for(self, accuracy: float) -> float:
        """Factor on the excitation that reaches this accuracy in one window; 0 without noise."""
        return HOLDING_95 * float(self.relative.max()) / accuracy


def accuracy_of(waveform: Waveform, machine: Machine) -> LineAccuracy:
    """Sigma of one window of the joint or indirect estimate, sigma² = N·σ²/|U_k|², worst over the places.

    For white noise of standard deviation σ on the output, to first order in noise over signal, in the periodic state.
    Near a lightly damped resonance the real value is up to 1.4 times larger in windows of a tenth of a second; the
    effect of motion within a window is not included.
    """
    f = waveform.lines.frequency_hz
    seen = waveform.amplitude * waveform.lines.window / 2
    sigma, relative = np.zeros(f.shape), np.full(f.shape, -inf)
    for place in machine.places:
        here = machine.noise * np.sqrt(waveform.lines.window) / (seen * np.abs(machine.torque(place, f)))
        share = here / np.abs(place.plant.response(f))
        sigma, relative = np.where(share > relative, here, sigma), np.maximum(share, relative)
    return LineAccuracy(sigma, relative)
