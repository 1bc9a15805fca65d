"""The step of a tuned loop in the non-linear simulated axis, and that of an exactly known one, are as predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.core import PID
from livebode.simulation import BeltAxis
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted_steps import predicted_steps
from studies.tune import LINES as COARSE
from studies.tune import machines
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


def test_the_plant_between_exact_lines_is_the_true_one_at_resonances_too() -> None:
    """Ten machines with resonances of 3 … 10 % damping, lines 2 Hz apart: within 2 %; cubics of log G are 50 % off."""
    f = COARSE.frequency_hz
    for machine, _ in zip(machines(2), range(10)):
        prompt = replace(machine, delay_s=0.0)
        value = prompt.response(f)[np.newaxis]
        band = PlantBand.at_lines(f, value, 0 * np.abs(value), 0 * np.abs(value), RATE_HZ)
        at = (band.frequency_hz >= f[0]) & ~band.above
        error = np.abs(band.value[0, at] / prompt.response(band.frequency_hz[at]) - 1)
        assert error.max() < 0.02
        assert np.mean(error <= band.spread[0, at] + 2e-3) > 0.98


def test_noise_between_lines_makes_no_peak() -> None:
    """1/f with noise of 60 %: at most 1.3 times the larger of both lines; cubics of 1/G reach 3.8 times it."""
    f = COARSE.frequency_hz
    noise = np.random.default_rng(0).standard_normal((2, 20, f.size)) * 0.6 / np.sqrt(2)
    value = (1 + noise[0] + 1j * noise[1]) / (1j * f)
    size = 0.6 * np.abs(value)
    band = PlantBand.at_lines(f, value, 3 * size, size, RATE_HZ)
    left = np.clip(np.searchsorted(f, band.frequency_hz, side="right") - 1, 0, f.size - 2)
    inside = (band.frequency_hz >= f[0]) & ~band.above
    larger = np.maximum(np.abs(value[:, left]), np.abs(value[:, left + 1]))
    assert np.all(np.abs(band.value[:, inside]) < 1.3 * larger[:, inside])


def test_the_step_with_the_proposed_filters_is_as_predicted() -> None:
    """Of eight machines; the study has 60, of which some have no filters."""
    found = filtered(8)
    assert len(found) >= 6
    assert np.mean([one.inside for one in found]) > 0.85
    assert max(one.deviation for one in found) < 0.02
