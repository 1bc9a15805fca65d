"""The step of a tuned loop in the non-linear simulated axis, and that of an exactly known one, are as predicted."""

from __future__ import annotations

import numpy as np

from livebode.core import PID
from livebode.simulation import BeltAxis
from livebode.tuning.plant_band import PlantBand
from livebode.tuning.predicted_steps import predicted_steps
from studies.tune_filter_steps import compared as filtered
from studies.tune_filter_steps import stepped
from studies.tune_steps import LINES, RATE_HZ, compared


def test_the_step_in_the_nonlinear_axis_is_as_predicted() -> None:
    """Three steps of an axis. The study has 150, with a median deviation of 2 %."""
    steps, refused = compared(1)
    assert refused == 0
    assert max(one.deviation for one in steps) < 0.04
    assert np.mean([one.inside for one in steps]) > 0.8
    assert all(one.own <= one.inside for one in steps)


def test_the_step_of_a_known_plant_is_that_of_its_samples() -> None:
    """The lines up to 520 Hz alone give it within 1 %."""
    plant = BeltAxis().linear(0.8).sampled(RATE_HZ)
    controller = PID(gain=0.4, integral_time_s=0.1, rate_hz=RATE_HZ)
    y = stepped(plant, controller, (), 600)
    value = plant.response(LINES.frequency_hz)[np.newaxis]
    band = PlantBand.at_lines(LINES.frequency_hz, value, 0 * np.abs(value), 0 * np.abs(value), RATE_HZ)
    step, _ = predicted_steps(band, controller, (np.arange(y.size) + 0.5) / RATE_HZ)
    np.testing.assert_allclose(step.value[0], y, atol=0.01)
    first = step.time_s < 2e-3
    assert np.all(step.high[first] - step.low[first] > 0)


def test_the_step_with_the_proposed_filters_is_as_predicted() -> None:
    """Of eight machines; the study has 60, of which some have no filters."""
    found = filtered(8)
    assert len(found) >= 6
    assert np.mean([one.inside for one in found]) > 0.85
    assert max(one.deviation for one in found) < 0.02
