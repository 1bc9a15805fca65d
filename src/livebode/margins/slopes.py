"""How what is read from an open loop moves with the fit's parameters, to first order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.margins.crossings import Crossings
from livebode.margins.open_loop import OpenLoop

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STEP = 1e-5
_PEAK_STEP = 1e-3
_OF_SIGMA, _OF_VALUE = 1e-3, 1e-7  # what a parameter is moved by


class Fits(NamedTuple):
    """Values and their sigma, shape (rows, parameters)."""

    values: Floats
    sigma: Floats

    def of(self, row: NDArray[np.int64]) -> Fits:
        return Fits(self.values[row], self.sigma[row])


class Slopes(NamedTuple):
    """Of ln L at places: by ln f, shape (places,), and by each parameter in its sigmas, (places, parameters)."""

    by_frequency: Complex
    by_parameter: Complex


def slopes(loop: OpenLoop, fits: Fits, at: Crossings) -> Slopes:
    """Central differences of ln L where `at` says; by frequency one-sided at half the rate."""
    return _slopes(loop, fits.of(at.row), at.frequency_hz)


def _slopes(loop: OpenLoop, fits: Fits, frequency_hz: Floats) -> Slopes:
    """For one row of fits and one frequency each. A parameter without variance is not moved: it may not bear it."""
    f = frequency_hz[:, np.newaxis]
    above = np.minimum(f * (1 + _STEP), loop.rate_hz / 2)
    below = f * (1 - _STEP)
    moved = np.log(loop.at(fits.values, above) / loop.at(fits.values, below))[:, 0]
    by_frequency = moved / np.log(above / below)[:, 0]
    values, sigma = fits
    free = np.flatnonzero(np.any(sigma > 0, axis=0))
    step = np.maximum(_OF_SIGMA * sigma, _OF_VALUE * np.abs(values))[:, free]
    shifts = step[:, :, np.newaxis] * np.eye(values.shape[1])[free]
    tried = np.stack([values[:, np.newaxis] + shifts, values[:, np.newaxis] - shifts])
    everywhere = np.broadcast_to(f[np.newaxis], (2, len(f), free.size)).reshape(-1, 1)
    plus, minus = loop.at(tried.reshape(-1, values.shape[1]), everywhere).reshape(2, len(f), free.size)
    by_parameter = np.zeros(values.shape, dtype=np.complex128)
    by_parameter[:, free] = np.log(plus / minus) / (2 * step) * sigma[:, free]
    return Slopes(np.asarray(by_frequency, dtype=np.complex128), by_parameter)


def moved(residual: Floats, by: Floats) -> Floats:
    """d ln f by each parameter of a frequency at which something stays zero: −(slope by parameter)/(slope by ln f)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-by / residual[:, np.newaxis])


def peak_moved(loop: OpenLoop, fits: Fits, at: Crossings) -> Floats:
    """d ln f by each parameter of the frequency where |1 + L| is least; NaN at half the rate, where it stays."""
    inside = at.frequency_hz < loop.rate_hz / 2
    found = np.full((len(at.row), fits.values.shape[1]), np.nan)
    if inside.any():
        f, row = at.frequency_hz[inside], at.row[inside]
        around = [_distance_slopes(loop, fits.of(row), f * np.exp(step)) for step in (-_PEAK_STEP, _PEAK_STEP)]
        curvature, mixed = (after - before for before, after in zip(*around))
        found[inside] = moved(curvature, mixed)
    return found


def _distance_slopes(loop: OpenLoop, fits: Fits, frequency_hz: Floats) -> tuple[Floats, Floats]:
    """Of ln|1 + L|: by ln f and by each parameter."""
    value = loop.at(fits.values, frequency_hz[:, np.newaxis])[:, 0]
    closed = value / (1 + value)
    found = _slopes(loop, fits, frequency_hz)
    return (closed * found.by_frequency).real, (closed[:, np.newaxis] * found.by_parameter).real
