"""Descent of a multisine's L_2p norm over its phases, p rising, until the norm is the peak."""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Bins = NDArray[np.int64]

# p, each from where the one before ended: the low ones find the valley, the high ones the peak. 512 after 256 would
# take another 1e-3 off the crest factor at most.
_EXPONENTS = (4, 16, 64, 256)
_STEPS, _STEPS_WITHOUT_HESSIAN = 40, 200  # for each exponent
_SETTLED = 1e-4  # of the norm in one step, for the best of all starts
_DAMPING, _DAMPING_MIN = 1e-3, 1e-8  # of Levenberg and Marquardt, relative to the Hessian's diagonal
# Samples for one period of the highest line; with 4 the peak hides between them (crest factor 1.53 in place of 1.41).
_OVERSAMPLED = 8
_SAMPLES_MAX = 1 << 18


def period(bins: Bins, complexes: Complex, samples: int) -> Floats:
    """Re Σ c_k·e^(2πjkt) over one period, shape (…, samples), from c of shape (…, lines)."""
    spectrum = np.zeros((*complexes.shape[:-1], samples // 2 + 1), dtype=np.complex128)
    spectrum[..., bins] = complexes * (samples / 2)
    return np.asarray(scipy.fft.irfft(spectrum, samples, axis=-1))


def samples_for(highest: int, oversampled: int) -> int:
    """How many samples of a period are looked at; fewer where a lone line is very high, but above its Nyquist rate."""
    return int(scipy.fft.next_fast_len(min(oversampled * highest, max(_SAMPLES_MAX, 3 * highest)), real=True))


def descend_together(phases: Floats, bins: Bins, amplitude: Floats) -> Floats:
    """Gauss–Newton with damping from many starts at once, shape (starts, lines).

    Guillaume, Schoukens, Pintelon, Kollár, IEEE Trans. Instrum. Meas. 40(6), 1991: the norm is a sum of squares of
    x^p. JᵀJ of all pairs of lines is made of sums and differences of their bins in one spectrum, that of the
    weights x^(2p − 2), so no Jacobian is formed.
    """
    samples = samples_for(int(bins[-1]), _OVERSAMPLED)
    apart, added = bins[np.newaxis, :] - bins[:, np.newaxis], (bins[np.newaxis, :] + bins[:, np.newaxis]) % samples
    own = np.arange(bins.size)

    def norm(at: Floats, p: int) -> tuple[Floats, Floats, Floats]:
        x = period(bins, amplitude * np.exp(1j * at), samples)
        peak = np.max(np.abs(x), axis=-1)
        x /= peak[:, np.newaxis]
        return np.log(peak) + np.log(np.mean(x ** (2 * p), axis=-1)) / (2 * p), peak, x

    for p in _EXPONENTS:
        value, peak, x = norm(phases, p)
        damping = np.full(len(phases), _DAMPING)
        for _ in range(_STEPS):
            lines = amplitude * np.exp(1j * phases)
            weights = x ** (2 * p - 2)
            slope = -np.imag(lines * np.conj(scipy.fft.rfft(weights * x, axis=-1)[:, bins]))
            spectrum = scipy.fft.rfft(weights, axis=-1)
            straight = lines[:, :, np.newaxis] * lines[:, np.newaxis, :].conj() * _at(spectrum, apart, samples)
            crossed = lines[:, :, np.newaxis] * lines[:, np.newaxis, :] * _at(spectrum, added, samples).conj()
            hessian = 0.5 * np.real(straight - crossed)
            mean = np.mean(hessian[:, own, own], axis=-1)
            hessian[:, own, own] += (damping * mean)[:, np.newaxis]
            step = np.linalg.solve(hessian, slope[..., np.newaxis])[..., 0] * peak[:, np.newaxis] / (2 * p - 1)
            new_value, new_peak, new_x = norm(phases - step, p)
            better = new_value < value
            gain = float(np.max(np.where(better, value - new_value, 0.0)))
            phases = np.where(better[:, np.newaxis], phases - step, phases)
            x = np.where(better[:, np.newaxis], new_x, x)
            peak, value = np.where(better, new_peak, peak), np.where(better, new_value, value)
            damping = np.where(better, np.maximum(damping / 3, _DAMPING_MIN), damping * 4)
            if better.any() and gain < _SETTLED:
                break
    return phases


def _at(spectrum: Complex, bins: Bins, samples: int) -> Complex:
    """The spectrum of a real signal at any bin, also negative ones and those above the half, shape (starts, *bins)."""
    folded = np.abs(np.where(bins > samples // 2, bins - samples, bins))
    found = spectrum[:, folded]
    return np.where((bins < 0) | (bins > samples // 2), found.conj(), found)


def descend(phases: Floats, bins: Bins, amplitude: Floats) -> Floats:
    """The same from one start, shape (lines,), by L-BFGS: for so many lines that a Hessian would take too long."""
    from scipy.optimize import minimize  # a third of a second to import

    samples = samples_for(int(bins[-1]), _OVERSAMPLED)

    def norm(at: Floats, p: int) -> tuple[float, Floats]:
        lines = amplitude * np.exp(1j * at)
        x = period(bins, lines, samples)
        peak = np.max(np.abs(x))
        x /= peak
        power = x ** (2 * p - 1)
        total = float(power @ x)
        slope = -np.imag(lines * np.conj(scipy.fft.rfft(power)[bins])) / (peak * total)
        return float(np.log(peak) + np.log(total / samples) / (2 * p)), slope

    for p in _EXPONENTS:
        options = {"maxiter": _STEPS_WITHOUT_HESSIAN, "maxcor": 20}
        phases = minimize(norm, phases, (p,), method="L-BFGS-B", jac=True, options=options).x
    return phases
