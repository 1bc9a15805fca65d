"""Harmonics: lines of constant amplitude, such as a rotation or the mains, which are not modes."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode_modes.stabilisation import Mode

SPREAD_MAX = 0.25
"""Variance of a harmonic's power over the hops, relative to its mean squared; it is 1 for a mode under noise."""
_DECAYS = 10.0  # a window of so many decay times shows how the amplitude of a mode varies
_SIGMAS = 2.0


def is_harmonic(mode: Mode, y: Floats, rate_hz: float) -> bool:
    """Whether a pole is a harmonic: nearly no damping, and an amplitude that does not vary from hop to hop.

    The amplitude of a mode under noise is that of a Gaussian signal, and a decay's falls; that of a harmonic is
    constant. It is the test by the kurtosis of the band-limited output, 3 for a mode and 1.5 for a harmonic (Jacobsen,
    Andersen & Brincker 2007), on the demodulated output.

    Parameters
    ----------
    y
        The outputs in each hop, (hops, outputs, samples).
    """
    omega = 2 * np.pi * mode.frequency_hz
    window_s = y.shape[0] * y.shape[2] / rate_hz
    damping = mode.damping - _SIGMAS * float(np.sqrt(mode.covariance[1, 1]))
    if damping * omega * window_s > _DECAYS:
        return False
    pairs = np.concatenate([y[:-1], y[1:]], axis=2)  # a longer part separates a line better from a mode beside it
    rotating = np.exp(-1j * omega * np.arange(pairs.shape[2]) / rate_hz) * np.hanning(pairs.shape[2])
    power = np.abs(pairs @ rotating) ** 2
    spread = power.var(axis=0) / power.mean(axis=0) ** 2
    return bool(spread[int(np.argmax(power.mean(axis=0)))] <= SPREAD_MAX)
