"""A design warns where its excitation reverses motor or load at the slowest stroke, with an amplitude that does not."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from livebode.simulation import BeltAxis, Mechanics, SimulatedAxis, Standstill, Strokes, StrokeSequence
from livebode_design import ExperimentSpec, belt_machine, choose
from livebode_design.reversal import reversal, slowest_stroke

SPEC = ExperimentSpec(band_hz=(20, 140), resolution_hz=20)
SLOW = BeltAxis(motion=Strokes(speed_m_per_s=0.1))


def row(axis: BeltAxis, amplitude_n_m: float) -> str | None:
    design = choose(replace(SPEC, amplitude_n_m=amplitude_n_m), belt_machine(axis))
    return next((choice.why for choice in design.choices if choice.what == "reversal"), None)


def test_the_amplitude_that_a_warning_names_reverses_nothing() -> None:
    why = row(SLOW, 2.5)
    assert why is not None
    assert why.startswith("WARNING: above the 0.1 m/s of the slowest stroke")
    most = re.search(r"take at most ([0-9.]+) N m", why)
    assert most is not None
    accepted = row(SLOW, float(most[1]))
    assert accepted is not None
    assert accepted.startswith("below the 0.1 m/s")
    assert row(BeltAxis(motion=Standstill()), 2.5) is None


def test_the_speed_of_the_excitation_is_that_of_the_simulated_motor_and_load() -> None:
    """On the machine frozen at one place, in the periodic state: within 1 %."""
    at_m = 0.8
    frozen = Mechanics(frozen_position_m=at_m)
    axis = BeltAxis(mechanics=frozen, motion=Strokes(speed_m_per_s=0.1))
    machine = belt_machine(axis)
    design = choose(replace(SPEC, amplitude_n_m=1.0), machine)
    found = reversal(design.waveform, machine)
    still = replace(axis, motion=Standstill(position_m=at_m), excitation_n_m=design.waveform.samples)
    _, truth = SimulatedAxis(replace(still, seconds=2.0, run_in_s=6.0)).run()
    motor, load = truth.states[1] * frozen.radius_m, np.gradient(truth.position_m) * design.waveform.lines.rate_hz
    assert found is not None
    assert found.excited_m_per_s == pytest.approx(max(np.abs(motor).max(), np.abs(load).max()), rel=0.01)


def test_the_slowest_of_several_strokes_counts() -> None:
    _, speed = StrokeSequence(turning_points_m=(0.4, 1.2, 0.4), speeds_m_per_s=(0.5, 0.2)).cycle(1000)
    assert slowest_stroke(speed) == pytest.approx(0.2)
    assert slowest_stroke(np.zeros(3)) is None
