"""Minimisation of a multisine's L_2p norm over its phases, with p rising until the norm is the peak."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import fast_length, needing

Bins = NDArray[np.int64]

# p, each started from the previous result, and samples for one period of the highest line: the low norms find the
# valley, with few samples; the high ones find the peak, which must not be between samples.
VALLEY, PEAK = ((2, 8), (8, 8), (32, 12)), ((128, 24), (512, 24))
Stages = tuple[tuple[int, int], ...]
_STEPS, _STEPS_WITHOUT_HESSIAN = 40, 200  # for each exponent
_SETTLED = 1e-4  # of the norm in one step, for the best of all starts
_DAMPING, _DAMPING_MIN = 1e-3, 1e-8  # of Levenberg and Marquardt, relative to the Hessian's diagonal
_SAMPLES_MAX = 1 << 18


def period(bins: Bins, complexes: Complex, samples: int) -> Floats:
    """Re Σ c_k·e^(2πjkt) over one period, shape (…, samples), from c of shape (…, lines)."""
    spectrum = np.zeros((*complexes.shape[:-1], samples // 2 + 1), dtype=np.complex128)
    spectrum[..., bins] = complexes * (samples / 2)
    return np.asarray(np.fft.irfft(spectrum, samples, axis=-1))


def samples_for(highest: int, oversampled: int) -> int:
    """Number of samples of a period; fewer where a single line is very high, but above its Nyquist rate."""
    return fast_length(min(oversampled * highest, max(_SAMPLES_MAX, 3 * highest)))


def _power(x: Floats, exponent: int) -> Floats:
    """x^exponent by squaring, in a tenth of the time of NumPy's pow.

    >>> _power(np.array([2.0, -3.0]), 5).tolist()
    [32.0, -243.0]
    """
    result, square = np.ones_like(x), x
    while exponent:
        if exponent & 1:
            result *= square
        exponent >>= 1
        if exponent:
            square = square * square
    return result


def descend_together(phases: Floats, bins: Bins, amplitude: Floats, stages: Stages) -> Floats:
    """Gauss–Newton with damping from many starts at once, shape (starts, lines).

    Guillaume, Schoukens, Pintelon, Kollár, IEEE Trans. Instrum. Meas. 40(6), 1991: the norm is a sum of squares of
    x^p. JᵀJ of all pairs of lines is computed from sums and differences of their bins in one spectrum, that of the
    weights x^(2p − 2), so no Jacobian is formed.
    """
    for p, oversampled in stages:
        norm = _Norm(bins, amplitude, p, samples_for(int(bins[-1]), oversampled))
        value, peak, x = norm(phases)
        damping = np.full(len(phases), _DAMPING)
        for _ in range(_STEPS):
            step = norm.step(phases, x, damping) * peak[:, np.newaxis]
            new_value, new_peak, new_x = norm(phases - step)
            better = new_value < value
            gain = float(np.max(np.where(better, value - new_value, 0.0)))
            phases = np.where(better[:, np.newaxis], phases - step, phases)
            x = np.where(better[:, np.newaxis], new_x, x)
            peak, value = np.where(better, new_peak, peak), np.where(better, new_value, value)
            damping = np.where(better, np.maximum(damping / 3, _DAMPING_MIN), damping * 4)
            if better.any() and gain < _SETTLED:
                break
    return phases


class _Norm:
    """ln of the L_2p norm of many periods, and the step that reduces it."""

    def __init__(self, bins: Bins, amplitude: Floats, p: int, samples: int) -> None:
        self._bins, self._amplitude, self._p, self._samples = bins, amplitude, p, samples
        self._apart = bins[np.newaxis, :] - bins[:, np.newaxis]
        self._added = (bins[np.newaxis, :] + bins[:, np.newaxis]) % samples

    def __call__(self, phases: Floats) -> tuple[Floats, Floats, Floats]:
        """Norm and peak, shape (starts,), and the periods relative to their peaks."""
        x = period(self._bins, self._amplitude * np.exp(1j * phases), self._samples)
        peak = np.max(np.abs(x), axis=-1)
        x /= peak[:, np.newaxis]
        return np.log(peak) + np.log(np.mean(_power(x, 2 * self._p), axis=-1)) / (2 * self._p), peak, x

    def step(self, phases: Floats, x: Floats, damping: Floats) -> Floats:
        """(JᵀJ + damping)⁻¹·Jᵀr/(2p − 1), for a peak of 1, shape (starts, lines)."""
        lines = self._amplitude * np.exp(1j * phases)
        weights = _power(x, 2 * self._p - 2)
        slope = -np.imag(lines * np.conj(np.fft.rfft(weights * x, axis=-1)[:, self._bins]))
        spectrum = np.fft.rfft(weights, axis=-1)
        columns, rows = lines[:, np.newaxis, :], lines[:, :, np.newaxis]
        hessian = np.real(rows * columns.conj() * _at(spectrum, self._apart, self._samples))
        hessian -= np.real(rows * columns * _at(spectrum, self._added, self._samples).conj())
        hessian /= 2
        own = np.arange(self._bins.size)
        hessian[:, own, own] += (damping * np.mean(hessian[:, own, own], axis=-1))[:, np.newaxis]
        return np.asarray(np.linalg.solve(hessian, slope[..., np.newaxis])[..., 0] / (2 * self._p - 1))


def _at(spectrum: Complex, bins: Bins, samples: int) -> Complex:
    """The spectrum of a real signal at any bin, also negative ones and those above the half, shape (starts, *bins)."""
    folded = np.abs(np.where(bins > samples // 2, bins - samples, bins))
    values = spectrum[:, folded]
    return np.where((bins < 0) | (bins > samples // 2), values.conj(), values)


def descend(phases: Floats, bins: Bins, amplitude: Floats, stages: Stages) -> Floats:
    """Phases from one start, shape (lines,), by L-BFGS: for so many lines that a Hessian would take too long."""
    with needing("SciPy", "analysis", f"a design of {bins.size} lines"):
        from scipy.optimize import minimize  # a third of a second to import

    def norm(angles: Floats, p: int, samples: int) -> tuple[float, Floats]:
        lines = amplitude * np.exp(1j * angles)
        x = period(bins, lines, samples)
        peak = np.max(np.abs(x))
        x /= peak
        power = _power(x, 2 * p - 1)
        total = float(np.sum(power * x))  # no BLAS: its threads cost ten times this on a busy machine
        slope = -np.imag(lines * np.conj(np.fft.rfft(power)[bins])) / (peak * total)
        return float(np.log(peak) + np.log(total / samples) / (2 * p)), slope

    for p, oversampled in stages:
        given: Any = {"args": (p, samples_for(int(bins[-1]), oversampled)), "method": "L-BFGS-B", "jac": True}
        phases = minimize(norm, phases, **given, options={"maxiter": _STEPS_WITHOUT_HESSIAN, "maxcor": 20}).x
    return phases
