"""Crest factors by clipping, an alternative method: E. Van der Ouderaa, J. Schoukens, J. Renneboog 1988.

The period is clipped at a share of its peak, and the phases of what is left go back to the wanted amplitudes, again and
again; the share rises slowly. From Schroeder's phases and many random ones.
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from livebode.excitation import crest_between_samples, schroeder_phases

_OVERSAMPLED = 16
_SHARES = np.repeat([0.75, 0.8, 0.85, 0.9, 0.94, 0.97, 0.985, 0.993, 0.997, 0.999], 40)
_TOGETHER = 500


def clipped_phases(count: int, starts: int, seed: int) -> NDArray[np.float64]:
    """Phases of sines 1 … count of one amplitude, shape (count,): the best that any start leads to."""
    generator = np.random.default_rng(seed)
    best, found = np.inf, np.zeros(count)
    for first in range(0, starts, _TOGETHER):
        phases = generator.uniform(0, 2 * np.pi, (min(_TOGETHER, starts - first), count))
        if first == 0:
            phases[0] = schroeder_phases(count)
        phases = _clipped(phases - np.pi / 2)
        # The peak between samples only of those that look well at them.
        for one in phases[np.argsort(np.max(np.abs(_period(phases)), axis=1))[:5]]:
            crest = crest_between_samples(np.arange(1, count + 1), 1.0, one + np.pi / 2)
            if crest < best:
                best, found = crest, one + np.pi / 2
    return found


def _period(phases: NDArray[np.float64]) -> NDArray[np.float64]:
    count = phases.shape[1]
    spectrum = np.zeros((len(phases), 8 * count + 1), dtype=np.complex128)
    spectrum[:, 1 : count + 1] = np.exp(1j * phases)
    return np.asarray(scipy.fft.irfft(spectrum, _OVERSAMPLED * count, axis=1))


def _clipped(phases: NDArray[np.float64]) -> NDArray[np.float64]:
    count = phases.shape[1]
    for share in _SHARES:
        x = _period(phases)
        most = share * np.max(np.abs(x), axis=1, keepdims=True)
        phases = np.angle(scipy.fft.rfft(np.clip(x, -most, most), axis=1)[:, 1 : count + 1])
    return phases
