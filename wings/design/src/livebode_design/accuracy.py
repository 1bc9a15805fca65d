"""Accuracy of each line with the recording time that it needs, and its amplitude at the encoder of the motor."""

from __future__ import annotations

from math import ceil, inf, sqrt

import numpy as np

from livebode.arrays import Floats
from livebode.core import CIRCLE_FACTOR, UsageError
from livebode.dataclass import dataclass
from livebode.excitation import Waveform
from livebode_design.machine import Machine

COUNTS_MIN = 0.5
"""Amplitude below which a line alone does not move an encoder at standstill from one count to the next."""


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
        return max(1, ceil((CIRCLE_FACTOR * float(self.relative.max()) / accuracy) ** 2 - 1e-9))

    def reached(self, windows: int) -> Floats:
        """The 95 % bound of each line after this number of windows, as a share of |G|."""
        return np.asarray(CIRCLE_FACTOR * self.relative / sqrt(windows))

    def factor_for(self, accuracy: float) -> float:
        """Factor on the excitation that reaches this accuracy in one window; 0 without noise."""
        return CIRCLE_FACTOR * float(self.relative.max()) / accuracy


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


def encoder_counts(waveform: Waveform, machine: Machine) -> Floats | None:
    """Amplitude of each line at the motor's encoder, in counts, at the place where it is least, shape (lines,).

    None where the encoder's step is not known. Of the linear machine in the periodic state. The rounding of an axis
    that moves over many counts within a window is noise, which averaging reduces; that of an axis at standstill
    repeats with the excitation, and averaging does not reduce it.
    """
    if machine.encoder_step_m == 0:
        return None
    f = waveform.lines.frequency_hz
    moved = [np.abs(machine.torque(place, f) * place.angle.response(f)) for place in machine.places]
    return np.asarray(waveform.amplitude * np.min(moved, axis=0) / machine.encoder_step_m)


def encoder_words(counts: Floats, frequency_hz: Floats, *, moves: bool) -> tuple[str, str]:
    """The weakest line in counts, and its verdict, for the table of a design."""
    weakest, small = int(np.argmin(counts)), int(np.count_nonzero(counts < COUNTS_MIN))
    value = f"{counts[weakest]:.2g} counts at {frequency_hz[weakest]:g} Hz"
    if not small:
        return value, f"the weakest line; {COUNTS_MIN:g} or more is measurable"
    if moves:
        return value, f"{small} lines below {COUNTS_MIN:g} counts: measurable only by the motion over many counts"
    return value, f"WARNING: {small} lines below {COUNTS_MIN:g} counts: not measurable; raise the amplitude there"
