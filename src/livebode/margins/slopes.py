"""Slopes of the values read from an open loop by the fit's parameters, to first order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.margins.crossings import Crossings
from livebode.margins.open_loop import OpenLoop

_STEP = 1e-5
_PEAK_STEP = 1e-3
_OF_SIGMA, _OF_VALUE = 1e-3, 1e-7  # step of a parameter


class FittedValues(NamedTuple):
    """Values and their sigma, shape (rows, parameters)."""

    values: Floats
    sigma: Floats

    def of(self, row: NDArray[np.int64]) -> FittedValues:
        return FittedValues(self.values[row], self.sigma[row])


class Slopes(NamedTuple):
    """Of ln L at places: by ln f, shape (places,), and by each parameter in its sigmas, (places, parameters)."""

    by_frequency: Complex
    by_parameter: Complex

    def part(self, places: slice) -> Slopes:
        return Slopes(self.by_frequency[places], self.by_parameter[places])


def slopes(loop: OpenLoop, fits: FittedValues, at: Crossings) -> Slopes:
    """Central differences of ln L at these places; by frequency one-sided at half the rate."""
    return _slopes(loop, fits.of(at.row), at.frequency_hz)


def _slopes(loop: OpenLoop, fits: FittedValues, frequency_hz: Floats) -> Slopes:
    """For one row of fits and one frequency each. A parameter without variance is not moved: it may be at its limit."""
    values, sigma = fits
    places, n = values.shape
    above, below = np.minimum(frequency_hz * (1 + _STEP), loop.rate_hz / 2), frequency_hz * (1 - _STEP)
    free = np.flatnonzero(np.any(sigma > 0, axis=0))
    step = np.maximum(_OF_SIGMA * sigma, _OF_VALUE * np.abs(values))[:, free]
    shifts = (step[:, :, np.newaxis] * np.eye(n)[free]).swapaxes(0, 1)
    # All in one call: for few places the number of calls determines the time.
    tried = np.concatenate([values[np.newaxis], values[np.newaxis], values + shifts, values - shifts])
    at_hz = np.concatenate([above, below, np.tile(frequency_hz, 2 * free.size)])
    found = loop.at(tried.reshape(-1, n), at_hz[:, np.newaxis]).reshape(len(tried), places)
    by_frequency = np.log(found[0] / found[1]) / np.log(above / below)
    plus, minus = found[2 : 2 + free.size], found[2 + free.size :]
    by_parameter = np.zeros(values.shape, dtype=np.complex128)
    # A parameter that only some rows move has no step in the others where it is zero.
    shares = np.divide(sigma[:, free], 2 * step, out=np.zeros(step.shape), where=step > 0)
    by_parameter[:, free] = np.log(plus / minus).T * shares
    return Slopes(np.asarray(by_frequency, dtype=np.complex128), by_parameter)


def moved(residual: Floats, by: Floats) -> Floats:
    """d ln f by each parameter for the root of a function: −(slope by parameter)/(slope by ln f)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-by / residual[:, np.newaxis])


def peak_moved(loop: OpenLoop, fits: FittedValues, at: Crossings) -> Floats:
    """d ln f by each parameter of the frequency where |1 + L| is least; NaN at half the rate, where it is fixed."""
    inside = at.frequency_hz < loop.rate_hz / 2
    found = np.full((len(at.row), fits.values.shape[1]), np.nan)
    if inside.any():
        f, row = at.frequency_hz[inside], at.row[inside]
        both = np.concatenate([f * np.exp(-_PEAK_STEP), f * np.exp(_PEAK_STEP)])
        by_f, by = _distance_slopes(loop, fits.of(np.tile(row, 2)), both)
        found[inside] = moved(by_f[len(f) :] - by_f[: len(f)], by[len(f) :] - by[: len(f)])
    return found


def _distance_slopes(loop: OpenLoop, fits: FittedValues, frequency_hz: Floats) -> tuple[Floats, Floats]:
    """Of ln|1 + L|: by ln f and by each parameter."""
    value = loop.at(fits.values, frequency_hz[:, np.newaxis])[:, 0]
    closed = value / (1 + value)
    found = _slopes(loop, fits, frequency_hz)
    return (closed * found.by_frequency).real, (closed[:, np.newaxis] * found.by_parameter).real
