"""The step of a tuned loop in the non-linear simulated axis, and that of an exactly known one, are as predicted."""

from __future__ import annotations

import numpy as np

from livebode.core import PID
from livebode.simulation import BeltAxis
from livebode.tuning.plant_band import PlantBand
from livebode.tuning.predicted_steps import predicted_steps
from studies.tune_steps import LINES, RATE_HZ, compared


def test_the_step_in_the_nonlinear_axis_is_as_predicted() -> None:
    """Six steps: of two axes, at three places. The study has 150, with a median deviation of 2 %."""
    steps, refused = compared(2)
    assert refused == 0
    assert max(one.deviation for one in steps) < 0.04
    assert np.mean([one.inside for one in steps]) > 0.75


def test_the_step_of_a_known_plant_is_that_of_its_samples() -> None:
    """Plant and controller computed tick by tick; the lines up to 520 Hz alone give it within 1 %."""
    plant = BeltAxis().linear(0.8).sampled(RATE_HZ)
    controller = PID(gain=0.4, integral_time_s=0.1, rate_hz=RATE_HZ)
    state, total, y = np.zeros(len(plant.b)), 0.0, np.empty(600)
    for n in range(y.size):
        y[n] = plant.c @ state
        total += (1 - y[n]) / (RATE_HZ * controller.integral_time_s)
        state = plant.a @ state + plant.b * controller.gain * (1 - y[n] + total)
    value = plant.response(LINES.frequency_hz)[np.newaxis]
    band = PlantBand.at_lines(LINES.frequency_hz, value, 0 * np.abs(value), 0 * np.abs(value), RATE_HZ)
    step, _ = predicted_steps(band, controller, (np.arange(y.size) + 0.5) / RATE_HZ)
    np.testing.assert_allclose(step.value[0], y, atol=0.01)
    first = step.time_s < 2e-3
    assert np.all(step.high[first] - step.low[first] > 0)
