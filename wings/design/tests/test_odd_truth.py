"""Default designs are odd with detection lines, keep away from the mains, and give each line in encoder counts."""

from __future__ import annotations

from dataclasses import replace
from math import gcd

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from livebode.core import UsageError
from livebode.excitation import multisine, recognise
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, Strokes
from livebode_design import ExperimentSpec, belt_machine, choose
from livebode_design.grid import grid
from tests.support.errors import refused

RATE_HZ = 4000.0


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(1, 300), st.floats(20, 500), st.sampled_from([2.5, 5.0, 7.0, 10.0, 20.0]), st.integers(0, 2**31))
def test_a_band_becomes_odd_lines_with_detection_lines_away_from_the_mains(low, width, resolution_hz, seed):
    spec = ExperimentSpec(band_hz=(low, low + width), resolution_hz=resolution_hz, seed=seed)
    assume(width > 2.5 * resolution_hz)
    found = grid(spec, RATE_HZ)
    lines, spacing_hz = found.lines, found.lines.resolution_hz
    assert all(k % 2 for k in lines.bins)
    nearest = [min(abs(f - m * round(f / m)) if f > m / 2 else m - f for m in (50, 60)) for f in lines.frequency_hz]
    if found.mains:
        assert min(nearest) >= spacing_hz / 2 * (1 - 1e-6)
    between = {k for k in lines.quiet if k % 2} - set(found.mains)
    if len(lines) + len(between) >= 4:
        assert len(between) == (len(lines) + len(between)) // 4
        assert gcd(lines.window, *lines.bins) == 1


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.sampled_from([200, 400, 500, 800]), st.integers(0, 1000), st.floats(0, 0.3))
def test_auto_finds_the_period_the_lines_and_the_detection_lines_of_a_design(window, seed, noise):
    lines = grid(ExperimentSpec(band_hz=(20, 600), window=window, seed=seed), RATE_HZ).lines
    assume(gcd(window, *lines.bins) == 1)
    rng = np.random.default_rng(seed)
    played = np.resize(multisine(lines, 1.0, "random", seed=seed), 20 * window + 17)
    found = recognise(played + noise * rng.standard_normal(played.size), RATE_HZ)
    assert (found.period, found.lines.bins, found.lines.quiet) == (window, lines.bins, lines.quiet)


def test_lines_at_the_mains_frequency_are_left_out_and_reported():
    machine = belt_machine(BeltAxis(sensor=Sensor(noise_rad_per_s=0.1)))
    spec = ExperimentSpec(band_hz=(20, 200), window=400, amplitude_n_m=0.5)
    avoided = choose(spec, machine)
    assert not {50.0, 150.0} & set(avoided.waveform.lines.frequency_hz)
    (row,) = [choice for choice in avoided.choices if choice.what == "mains"]
    assert row.why == "no line at 50, 150 Hz"
    kept = choose(replace(spec, mains_hz=[], kind="multisine"), machine)
    assert {50.0, 150.0} <= set(kept.waveform.lines.frequency_hz)
    given_lines = choose(ExperimentSpec(lines="20:140:20", window=400, amplitude_n_m=0.5), machine)
    (row,) = [choice for choice in given_lines.choices if choice.what == "mains"]
    assert row.why == "WARNING: hum adds to the lines at 60, 100, 120 Hz; move them, or refine"


def test_the_counts_at_the_encoder_are_those_of_the_simulated_axis():
    axis = BeltAxis(sensor=Sensor(encoder_counts_per_turn=2**12))
    design = choose(ExperimentSpec(band_hz=(20, 140), resolution_hz=10, amplitude_n_m=0.2), belt_machine(axis))
    exact = replace(axis, sensor=Sensor(), excitation_n_m=design.waveform.samples, seconds=0.4, run_in_s=20.0)
    angle = SimulatedAxis(exact).run()[0]["position"].reshape(2, 800)[1]
    simulated = np.abs(np.fft.rfft(angle)[list(design.waveform.lines.bins)]) / 400 / axis.sensor.encoder_step_rad
    np.testing.assert_allclose(design.encoder_counts, simulated, rtol=0.01)
    (row,) = [choice for choice in design.choices if choice.what == "encoder"]
    assert row.value.startswith(f"{simulated.min():.2g} counts at ")
    assert "not measurable" in row.why
    moving = choose(
        ExperimentSpec(band_hz=(20, 140), resolution_hz=10, amplitude_n_m=0.2),
        belt_machine(replace(axis, motion=Strokes())),
    )
    (row,) = [choice for choice in moving.choices if choice.what == "encoder"]
    assert "only by the motion" in row.why
    assert (
        choose(ExperimentSpec(lines="20", window=400, amplitude_n_m=0.2), belt_machine(BeltAxis())).encoder_counts
        is None
    )


@pytest.mark.parametrize("mains_hz", [[0.0], [float("nan")]])
def test_mains_that_are_no_frequency_are_refused(mains_hz):
    with refused(UsageError, "out-of-range", argument="mains_hz"):
        ExperimentSpec(lines="20", mains_hz=mains_hz)
