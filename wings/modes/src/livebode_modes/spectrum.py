"""Periodogram of a window, and the expected one of a mode."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import needing
from livebode.dataclass import dataclass

with needing("SciPy", "analysis", "a run from the outputs alone"):
    import scipy  # its parts are loaded when they are first used

_TAPERED = 0.2  # of the window: lines and the rigid motion leak less, for 5 % more sigma
_REACH, _REACH_MIN, _SHARE, _BINS_MIN = 8.0, 3.0, 0.25, 12.0
"""Region on either side of a mode, in half-power widths: it tells the frequency from a skewed resonance.

Further away than a quarter of the frequency the force is not white; three widths, and twelve bins, are in any case.
"""
_GAIN_MIN = 1e-3
_FOLDS = np.array([-2, -1, 1, 2])


@dataclass(frozen=True, eq=False)
class Taper:
    """Weights of the samples of a window, and their effect on a periodogram.

    Attributes
    ----------
    weights
        0 where a hop is missing; the sum of their squares is 1.
    overlap
        Correlation of the weights with themselves at the lags 0 … N − 1.
    dependence
        Correlation of the periodogram at bins that are 0, 1, 2 … apart.
    """

    weights: Floats
    overlap: Floats
    dependence: Floats


def taper(present: NDArray[np.bool_], hop_samples: int) -> Taper:
    """The taper of a window some of whose hops are missing."""
    return _taper(present.tobytes(), hop_samples)


@lru_cache(maxsize=8)
def _taper(present: bytes, hop_samples: int) -> Taper:
    mask = np.repeat(np.frombuffer(present, dtype=np.bool_), hop_samples)
    weights = scipy.signal.windows.tukey(mask.size, _TAPERED) * mask
    weights /= np.sqrt(np.sum(weights**2))
    overlap = scipy.signal.correlate(weights, weights)[mask.size - 1 :]
    return Taper(weights, overlap, np.abs(np.fft.fft(weights**2)[:6]) ** 2)


class Spectrum:
    """Periodogram of one signal in a window, and the expected one of a mode.

    A pair of poles of a linear system under white noise has the correlation exp(−ζωτ)·(a·cos ω_d τ + b·sin ω_d τ). The
    expected periodogram is the transform of this correlation times the overlap of the taper, so that the leakage of a
    short window does not widen the resonance (Sykulski, Olhede, Guillaumin, Lilly & Early, "The debiased Whittle
    likelihood", Biometrika 2019).

    Parameters
    ----------
    x
        Signal at the reduced rate.
    of
        Taper of the window.
    rate_hz
        Of the signal.
    gain
        Squared gain of the filters before, at the bins 0 … N/2.
    """

    def __init__(self, x: Floats, of: Taper, rate_hz: float, gain: Floats) -> None:
        self.taper, self._rate_hz = of, rate_hz
        self._lags_s = np.arange(x.size) / rate_hz
        self.frequency_hz = np.fft.rfftfreq(x.size, 1 / rate_hz)
        self.power = np.abs(np.fft.rfft(x * of.weights)) ** 2 / np.maximum(gain, _GAIN_MIN)

    def region(self, frequency_hz: float, damping: float, limits_hz: tuple[float, float]) -> slice:
        """The bins around a mode that inform about it."""
        resolution_hz = float(self.frequency_hz[1])
        width_hz = 2 * damping * frequency_hz
        near_hz = min(_REACH * width_hz, _SHARE * frequency_hz)
        reach_hz = max(_REACH_MIN * width_hz, near_hz, _BINS_MIN * resolution_hz)
        low_hz, high_hz = max(frequency_hz - reach_hz, limits_hz[0]), min(frequency_hz + reach_hz, limits_hz[1])
        return slice(max(int(np.ceil(low_hz / resolution_hz)), 1), int(high_hz / resolution_hz) + 1)

    def expected(self, frequency_hz: float, damping: float, region: slice) -> tuple[Floats, Floats]:
        """Expected periodograms of the parts a and b of a mode, (2, bins), and their slopes, (2, 2, bins).

        The slopes are those along frequency, and along the logarithm of damping.
        """
        omega, rest = 2 * np.pi * frequency_hz, np.sqrt(1 - damping**2)
        root = omega * complex(-damping, rest)
        decay = np.exp(root * self._lags_s) * self.taper.overlap
        decay[0] /= 2
        values = np.stack([decay, decay * self._lags_s])
        spectra = scipy.fft.rfft(np.stack([values.real, values.imag], axis=1), axis=-1)[..., region].real
        spectra -= self._folded(root, region)
        along = spectra[1, 0] + 1j * spectra[1, 1]
        steps = 2 * np.pi * complex(-damping, rest), omega * damping * complex(-1, -damping / rest)
        slopes = np.array([[(step * along).real, (step * along).imag] for step in steps])
        factor = 2 * damping * omega / self._rate_hz
        parts = factor * spectra[0]
        return parts, factor * slopes + parts * np.array([1 / frequency_hz, 1.0])[:, np.newaxis, np.newaxis]

    def _folded(self, root: complex, region: slice) -> Floats:
        """What sampling folds into the spectrum of exp(sτ) and τ·exp(sτ); the low-pass has removed it, (2, 2, bins)."""
        omega = 2 * np.pi * (self.frequency_hz[region] + self._rate_hz * _FOLDS[:, np.newaxis])
        both = 1 / (root + np.array([1j, -1j])[:, np.newaxis, np.newaxis] * omega)
        one, two = -both.sum(axis=(0, 1)), (both**2).sum(axis=(0, 1))
        return np.asarray(np.array([[one.real, one.imag], [two.real, two.imag]]) * self._rate_hz / 2)
