"""Responses to a step, from frequency responses."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats

_PER_OCTAVE = 20


def step_response(frequency_hz: Floats, response: Complex, time_s: Floats) -> Floats:
    """The response of a stable system to a unit step at 0: (2/π)·∫ Re G(ω)·sin(ωt)/ω dω; shape (rows, times).

    Exact for a real part that is linear between the frequencies (with the sine integral), constant below the first and
    zero above the last.

    Parameters
    ----------
    frequency_hz
        Ascending; the first far below 1/time.
    response
        Shape (rows, frequencies).
    time_s
        Positive times, shape (times,).

    Examples
    --------
    >>> f = np.geomspace(1e-4, 1e4, 400)
    >>> lag = 1 / (1 + 2j * np.pi * f[np.newaxis] * 0.1)
    >>> step_response(f, lag, np.array([0.1, 0.3])).round(2)
    array([[0.63, 0.95]])
    """
    from scipy.special import sici

    f = np.union1d(frequency_hz, _even(frequency_hz))
    real = np.stack([np.interp(np.log(f), np.log(frequency_hz), row.real) for row in response])
    omega = 2 * np.pi * f
    slope = np.diff(real) / np.diff(omega)
    start = real[:, :-1] - slope * omega[:-1]
    turned = np.outer(omega, time_s)
    sine = sici(turned)[0]
    cosine = np.cos(turned) / np.maximum(time_s, 1e-300)
    area = real[:, :1] * sine[0] + start @ np.diff(sine, axis=0) - slope @ np.diff(cosine, axis=0)
    return np.asarray(2 / np.pi * area)


def _even(frequency_hz: Floats) -> Floats:
    """Frequencies of an even logarithmic grid over the same range."""
    count = int(np.log2(frequency_hz[-1] / frequency_hz[0]) * _PER_OCTAVE)
    return np.geomspace(frequency_hz[0], frequency_hz[-1], count)[1:-1]
