"""Frequencies and dampings of modes by maximum likelihood from the periodogram of a window, with their bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode_modes.spectrum import Spectrum

_DAMPING_LIMITS = 1e-5, 0.5
_ITERATIONS, _LINEAR_ITERATIONS, _HALVINGS = 30, 8, 8
_CLOSE = 1e-2  # squared distance to the maximum, in sigma
_LOG_DAMPING_STEP_MAX = 0.7
_LEAST = 1e-6  # of the greatest density: it has to be positive
_LINE_BINS = 4  # on either side of a line that are left out


@dataclass(frozen=True, eq=False)
class Maximum:
    """Maximum of the likelihood.

    Attributes
    ----------
    frequency_hz, damping
        Natural frequencies and damping ratios, (modes,).
    covariance
        Of both, (modes, 2, 2).
    log_likelihood
        Up to a constant.
    converged
        Whether it is a maximum, and not where the search ended.
    """

    frequency_hz: Floats
    damping: Floats
    covariance: Floats
    log_likelihood: float
    converged: bool


@dataclass(frozen=True, eq=False)
class _Density:
    """Density at some parameters: (frequencies, logarithms of dampings, amplitudes); its parts and their slopes."""

    theta: Floats
    rows: Floats
    slopes: Floats
    value: Floats
    objective: float

    def log_slope(self) -> Floats:
        """Slope of the logarithm of the density along each parameter."""
        n = len(self.slopes)
        parts = self.theta[2 * n : 4 * n].reshape(n, 2)
        curved = np.einsum("mp,mtpb->tmb", parts, self.slopes).reshape(2 * n, self.value.size)
        return np.concatenate([curved, self.rows]) / self.value


class Likelihood:
    """Likelihood of the periodogram in a region: each bin is exponentially distributed (Whittle 1953).

    The density is that of the modes and of a background c₀ + c₁/f² of noise and rigid motion.

    Parameters
    ----------
    spectrum
        Of the window.
    region
        Bins around a mode.
    lines_hz
        Frequencies of lines, which are left out.
    """

    def __init__(self, spectrum: Spectrum, region: slice, lines_hz: Sequence[float]) -> None:
        self._spectrum, self._region = spectrum, region
        f = spectrum.frequency_hz[region]
        self._power, self._background = spectrum.power[region], np.stack([np.ones_like(f), (f[f.size // 2] / f) ** 2])
        away = [np.abs(f - line_hz) > _LINE_BINS * spectrum.frequency_hz[1] for line_hz in lines_hz]
        self._weight = np.all(away, axis=0).astype(float) if away else np.ones_like(f)

    def maximum(self, frequency_hz: Floats, damping: Floats) -> Maximum | None:
        """The maximum near these modes; None if the search cannot begin there."""
        n, low = len(frequency_hz), float(np.median(self._power)) / 2
        start = np.concatenate([frequency_hz, np.log(damping), [2 * low, 0.0] * n, [low, low]])
        density = self._density(start, n)
        if density is None:
            return None
        for only_amplitudes in (True, False):
            density = self._climbed(density, n, only_amplitudes)
        slope = density.log_slope()
        inverse = _inverse((slope * self._weight) @ slope.T)
        gradient = self._gradient(slope, density)
        covariance = inverse @ self._scatter(slope) @ inverse
        z = np.exp(density.theta[n : 2 * n])
        pairs = np.stack([np.arange(n), n + np.arange(n)], axis=1)
        units = np.stack([np.ones(n), z], axis=1)
        bounds = (
            covariance[pairs[:, :, np.newaxis], pairs[:, np.newaxis]] * units[:, :, np.newaxis] * units[:, np.newaxis]
        )
        bounds *= (1 + bounds[:, 1:, 1:] / z[:, np.newaxis, np.newaxis] ** 2) ** 2  # z, and so sigma, may be too low
        return Maximum(density.theta[:n], z, bounds, -density.objective, bool(gradient @ inverse @ gradient < 1))

    def _density(self, theta: Floats, n: int) -> _Density | None:
        """None where the parameters are impossible."""
        low, high = np.log(_DAMPING_LIMITS)
        if np.any(theta[:n] <= 0) or np.any((theta[n : 2 * n] < low) | (theta[n : 2 * n] > high)):
            return None
        found = [self._spectrum.expected(f, z, self._region) for f, z in zip(theta[:n], np.exp(theta[n : 2 * n]))]
        rows = np.concatenate([*(parts for parts, _ in found), self._background])
        slopes = np.array([slopes for _, slopes in found]).reshape(n, 2, 2, rows.shape[1])
        value = theta[2 * n :] @ rows
        if value.min() <= _LEAST * self._power.max():
            return None
        return _Density(theta, rows, slopes, value, float(np.sum(self._weight * (np.log(value) + self._power / value))))

    def _climbed(self, density: _Density, n: int, only_amplitudes: bool) -> _Density:
        """The density after steps of Fisher's scoring."""
        first = 2 * n if only_amplitudes else 0
        for _ in range(_LINEAR_ITERATIONS if only_amplitudes else _ITERATIONS):
            slope = density.log_slope()[first:]
            gradient = self._gradient(slope, density)
            step = np.concatenate([np.zeros(first), _inverse((slope * self._weight) @ slope.T) @ gradient])
            if gradient @ step[first:] < _CLOSE:
                break
            step[n : 2 * n] = np.clip(step[n : 2 * n], -_LOG_DAMPING_STEP_MAX, _LOG_DAMPING_STEP_MAX)
            for size in 0.5 ** np.arange(_HALVINGS):
                trial = self._density(density.theta + size * step, n)
                if trial is not None and trial.objective < density.objective:
                    density = trial
                    break
            else:
                break
        return density

    def _gradient(self, slope: Floats, density: _Density) -> Floats:
        return np.asarray((slope * self._weight) @ (self._power / density.value - 1))

    def _scatter(self, slope: Floats) -> Floats:
        """Covariance of the gradient; the taper correlates neighbouring bins."""
        score = slope * self._weight
        scatter = score @ score.T
        for apart, share in enumerate(self._spectrum.taper.dependence[1:], 1):
            cross = share * (score[:, apart:] @ score[:, :-apart].T)
            scatter += cross + cross.T
        return np.asarray(scatter)


def _inverse(information: Floats) -> Floats:
    """Inverse of the information; directions without information are left out."""
    scale = np.sqrt(np.diagonal(information)) + np.finfo(float).tiny
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-8, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))
