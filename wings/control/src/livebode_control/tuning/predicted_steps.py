"""The steps that a loop is predicted to make, from frequency responses, with bands from the bounds of the plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Model, integral
from livebode.dataclass import dataclass
from livebode_control.tuning.plant_band import PlantBand, cubic

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


_DRAWS = 100  # of the plant
_BAND = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class PredictedStep:
    """A step response of each place, shape (places, times), and the band that holds all of them, shape (times,)."""

    time_s: Floats
    value: Floats
    low: Floats
    high: Floats

    @classmethod
    def over(cls, steps: Sequence[PredictedStep]) -> PredictedStep:
        """The step of several places at the same times: the hull of their bands."""
        value = np.concatenate([step.value for step in steps])
        low, high = np.min([step.low for step in steps], axis=0), np.max([step.high for step in steps], axis=0)
        return cls(steps[0].time_s, value, low, high)


def predicted_steps(plant: PlantBand, feedback: Model, time_s: Floats) -> tuple[PredictedStep, PredictedStep]:
    """Output after a unit step of the reference, and after one of a disturbance at the plant input.

    The reference acts as the feedback does, on all of F: so does the velocity reference of a cascade whose position
    reference is its integral. The band of a place is the middle 95 %, at each time, of 100 plants that are drawn with
    the noise of the lines, and between each two lines with the uncertainty of the interpolation; that of several places
    is the hull of theirs. Above the highest line the plant continues as a sampled integrator, and each drawn one is
    that times a number of the disc around 1 with radius 1: the first milliseconds are uncertain accordingly. Sample n
    after the step is at the time (n + 1/2)/rate.

    Biased where the plant is not linear, or changes over the range of positions that one place is the mean of.

    Parameters
    ----------
    plant
        The plant and its noise, at the places that the step may meet.
    feedback
        F.
    time_s
        Shape (times,).
    """
    behind = feedback.response(plant.frequency_hz)
    drawn = np.stack([_drawn(plant, place) for place in range(len(plant.value))])
    closed = drawn / (1 + drawn * behind)
    return _banded(plant.frequency_hz, closed * behind, time_s), _banded(plant.frequency_hz, closed, time_s)


def _drawn(plant: PlantBand, place: int) -> Complex:
    """The measured plant of a place, then those drawn around it, shape (1 + draws, frequencies)."""
    f, last = plant.frequency_hz, int(np.argmax(plant.above)) - 1
    fall = integral(f, 2 * f[-1], "forward")
    middle = np.where(plant.above, plant.value[place, last] * fall / fall[last], plant.value[place])
    plants = np.concatenate([middle[np.newaxis], middle + plant.sigma[place] * _noise(f, plant.lines_hz)])
    gap = np.searchsorted(plant.lines_hz, f)
    plants[1:] += _in_discs(plant.lines_hz.size + 1)[:, gap] * np.where(plant.above, 1.0, plant.spread[place]) * middle
    return plants


def _banded(frequency_hz: Floats, closed: Complex, time_s: Floats) -> PredictedStep:
    """From shape (places, 1 + draws, frequencies): first the measured plant.

    The sum of the impulse response of a sampled loop up to sample n is 1/π times the integral, up to half the rate, of
    Re T(θ)·sin((n + 1/2)·θ)/sin(θ/2): that of `step_response` with a factor.
    """
    half = np.pi / 2 * frequency_hz / frequency_hz[-1]
    rows = (closed * half / np.sin(half)).reshape(-1, frequency_hz.size)
    steps = step_response(frequency_hz, rows, time_s).reshape(*closed.shape[:2], time_s.size)
    low, high = np.quantile(steps[:, 1:], _BAND, axis=1, method="weibull")
    return PredictedStep(time_s, steps[:, 0], low.min(axis=0), high.max(axis=0))


def _noise(frequency_hz: Floats, lines_hz: Floats) -> Complex:
    """Circular noise of the lines, interpolated between them as the plant is, shape (draws, frequencies)."""
    real, imaginary = np.random.default_rng(0).standard_normal((2, _DRAWS, lines_hz.size)) / np.sqrt(2)
    return cubic(lines_hz, real + 1j * imaginary, frequency_hz)


def _in_discs(count: int) -> Complex:
    """Points of unit discs, evenly drawn, shape (draws, count)."""
    radius, turn = np.random.default_rng(1).random((2, _DRAWS, count))
    return np.asarray(np.sqrt(radius) * np.exp(2j * np.pi * turn))
