"""The steps that a loop is predicted to make, with bands from the bounds of the plant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.core import Model
from livebode.core.controllers import integral
from livebode.tuning.plant_band import PlantBand
from livebode.tuning.step_response import step_response

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_DRAWS = 100  # of the plant
_BAND = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class PredictedStep:
    """A step response with its 95 % band, each of shape (times,)."""

    time_s: Floats
    value: Floats
    low: Floats
    high: Floats


def predicted_steps(
    plant: PlantBand, feedback: Model, time_s: Floats, place: int = 0
) -> tuple[PredictedStep, PredictedStep]:
    """Output after a unit step of the reference, and after one of a disturbance at the plant input.

    The reference acts as the feedback does, on all of F: so does the velocity reference of a cascade whose position
    reference is its integral. The band is the middle 95 %, at each time, of 100 plants that are drawn with the noise
    of the lines. Above the highest line the plant continues as a sampled integrator, and each drawn one is that times
    a number of the disc around 1 with radius 1: the first milliseconds are uncertain accordingly. Sample n after the
    step is at the time (n + 1/2)/rate.

    Biased where the plant is not linear, or not the same at a place, within what the bounds do not contain.

    Parameters
    ----------
    plant
        The plant and its noise.
    feedback
        F.
    time_s
        Shape (times,).
    place
        Row of the plant.
    """
    f, last = plant.frequency_hz, int(np.argmax(plant.above)) - 1
    behind = feedback.response(f)
    fall = integral(f, 2 * f[-1], "forward")
    middle = np.where(plant.above, plant.value[place, last] * fall / fall[last], plant.value[place])
    plants = np.concatenate([middle[np.newaxis], middle + plant.sigma[place] * _noise(f, plant.lines_hz)])
    plants[1:, plant.above] += _in_disc()[:, np.newaxis] * middle[plant.above]
    closed = plants / (1 + plants * behind)
    return _banded(f, closed * behind, time_s), _banded(f, closed, time_s)


def _banded(frequency_hz: Floats, closed: Complex, time_s: Floats) -> PredictedStep:
    """The first row is the measured plant, the others are draws.

    The sum of the impulse response of a sampled loop up to sample n is 1/π times the integral, up to half the rate, of
    Re T(θ)·sin((n + 1/2)·θ)/sin(θ/2): that of `step_response` with a factor.
    """
    half = np.pi / 2 * frequency_hz / frequency_hz[-1]
    steps = step_response(frequency_hz, closed * half / np.sin(half), time_s)
    return PredictedStep(time_s, steps[0], *np.quantile(steps[1:], _BAND, axis=0))


def _noise(frequency_hz: Floats, lines_hz: Floats) -> Complex:
    """Circular noise of the lines, interpolated between them, shape (draws, frequencies)."""
    drawn = np.random.default_rng(0).standard_normal((2 * _DRAWS, lines_hz.size)) / np.sqrt(2)
    between = np.stack([np.interp(frequency_hz, lines_hz, row) for row in drawn])
    return np.asarray(between[:_DRAWS] + 1j * between[_DRAWS:])


def _in_disc() -> Complex:
    """Points of the unit disc, evenly drawn, shape (draws,)."""
    radius, turn = np.random.default_rng(1).random((2, _DRAWS))
    return np.asarray(np.sqrt(radius) * np.exp(2j * np.pi * turn))
