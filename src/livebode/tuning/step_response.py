"""Responses to a step, from frequency responses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_PER_OCTAVE = 60


def step_response(frequency_hz: Floats, response: Complex, time_s: Floats) -> Floats:
    """The response of a stable system to a unit step at 0: (2/π)·∫ Re G(ω)·sin(ωt)/ω dω; shape (rows, times).

    Biased above the highest frequency, where the system is taken as zero.

    Parameters
    ----------
    frequency_hz
        Ascending; the first far below 1/time.
    response
        Shape (rows, frequencies).
    time_s
        Shape (times,).

    Examples
    --------
    >>> f = np.geomspace(1e-4, 1e4, 400)
    >>> lag = 1 / (1 + 2j * np.pi * f[np.newaxis] * 0.1)
    >>> step_response(f, lag, np.array([0.1, 0.3])).round(2)
    array([[0.63, 0.95]])
    """
    count = int(np.log2(frequency_hz[-1] / frequency_hz[0]) * _PER_OCTAVE)
    f = np.geomspace(frequency_hz[0], frequency_hz[-1], count)
    real = np.stack([np.interp(np.log(f), np.log(frequency_hz), row.real) for row in response])
    # Integrated by parts of ln f; the sine integral of what is below the first frequency is small.
    kernel = np.sin(2 * np.pi * np.outer(f, time_s))
    step = np.gradient(np.log(f))
    return np.asarray(2 / np.pi * (real * step) @ kernel)
