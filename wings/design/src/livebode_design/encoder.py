"""Amplitude of each line at the motor, in counts of its encoder."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.excitation import Waveform
from livebode_design.machine import Machine

COUNTS_MIN = 0.5
"""Amplitude below which a line alone does not move an encoder at standstill from one count to the next."""


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
