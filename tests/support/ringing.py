"""Machines of which only the output is recorded: modes under white noise, a frequency that moves, a decay."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]

RATE_HZ = 125.0
FREQUENCY_HZ, DAMPING = (30.0, 47.0), (0.01, 0.02)
SHAPES = np.array([[1.0, 0.8], [0.6, -1.0]])
"""Of the two modes at two outputs, (outputs, modes)."""
_SETTLED = 2000  # samples at the beginning that are left out


def two_modes(seed: int, samples: int, outputs: int = 1, noise: float = 0.05) -> Floats:
    """Outputs (outputs, samples) of two modes of equal power under one white force, with noise of the sensor."""
    rng = np.random.default_rng(seed)
    force = rng.standard_normal(samples + _SETTLED)
    modes = np.array([_mode(f, z, force) for f, z in zip(FREQUENCY_HZ, DAMPING)])
    y = SHAPES[:outputs] @ modes
    return y + noise * y.std() * rng.standard_normal(y.shape)


def _mode(frequency_hz: float, damping: float, force: Floats) -> Floats:
    s = 2 * np.pi * frequency_hz * complex(-damping, np.sqrt(1 - damping**2))
    pole = np.exp(s / RATE_HZ)
    y = lfilter([1.0, -1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)[_SETTLED:]
    return np.asarray(y / y.std())


def moving_mode(seed: int, frequency_hz: ArrayLike, damping: float, rate_hz: float) -> Floats:
    """A mode under white noise whose natural frequency is different at every sample."""
    f = np.asarray(frequency_hz)
    rng = np.random.default_rng(seed)
    force = rng.standard_normal(len(f))
    steps = np.exp(2 * np.pi * f * complex(-damping, np.sqrt(1 - damping**2)) / rate_hz)
    state, y = 0j, np.empty(len(f))
    for k, step in enumerate(steps.tolist()):
        state = state * step + force[k]
        y[k] = state.imag
    return y / y.std() + 0.02 * rng.standard_normal(len(f))
