"""Proposed controllers on machines whose truth is known, and margins compared with python-control."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode import PID, Cascade
from livebode.core import Lines, Loop, Responses, TuneError
from livebode_control.tuning import LoopSpecification, disk_margin, tune
from livebode_control.tuning.code_text import c_header, structured_text
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.problem import TuningProblem
from livebode_control.tuning.structure import FeedbackStructure
from studies.tune import LIMITS, keeps, machines, measured, promises, proposed, stability, true_margins

VELOCITY = PID(gain=0.2, integral_time_s=0.1, derivative_time_s=1e-3, derivative_filter_s=1e-3, rate_hz=4000)
CASCADE = Cascade(PID(gain=0.2, integral_time_s=0.1, rate_hz=4000), PID(gain=5.0, rate_hz=2000, rate_divider=2))


def selected(responses: Responses, use: np.ndarray) -> Responses:
    lines = responses.lines.take(np.flatnonzero(use))
    value, sigma = responses.value[:, use], responses.sigma[:, use]
    ones, row = np.ones(value.shape), responses.first
    return Responses(lines, value, sigma, responses.dof, ones, ones > 0, row, row, responses.time_s, responses.schedule)


def test_promises_hold_on_the_true_machine_and_the_bandwidth_is_near_the_best() -> None:
    """Of 20 machines at ±5 %: at most three fall short (two or fewer of 20 with 92 % if each holds with 95 %)."""
    found = promises(0.05, 20)
    assert found.kept >= found.machines - found.refused - 3
    assert found.unstable == 0
    assert found.refused <= 2
    assert np.median(found.bandwidth) >= 0.9


def test_no_proposal_is_unstable() -> None:
    *_, first = stability(15, seed=7)
    *_, second = stability(10, first=15, seed=7)
    total = first + second
    assert total.machines == 25
    assert total.unstable == 0
    assert total.refused <= 5


@pytest.mark.parametrize("controller", [VELOCITY, CASCADE])
def test_the_response_of_the_structure_is_that_of_its_controller_and_its_slopes_are_exact(
    controller: PID | Cascade,
) -> None:
    f = np.geomspace(1, 1900, 40)
    structure = FeedbackStructure(controller, f, (60.0, 150.0), low_pass=True)
    x = np.clip(structure.start + 0.1, structure.low, structure.high)
    response, slopes = structure.response(x)
    np.testing.assert_allclose(response, structure.feedback(x).model.response(f), rtol=1e-9)
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = 1e-6
        ahead, behind = (structure.response(x + s)[0] for s in (step, -step))
        np.testing.assert_allclose(slopes[i], np.log(ahead / behind) / 2e-6, atol=1e-6, rtol=1e-5)


def test_the_slopes_of_the_limits_are_exact() -> None:
    machine = next(machines(5))
    plant = PlantBand.of(measured(machine, 0.1, 0), 4000.0)
    problem = TuningProblem(
        FeedbackStructure(machine.loop.feedback, plant.frequency_hz, (70.0,)),
        plant,
        LoopSpecification(bandwidth_hz=10.0, noise_gain=1.0),
    )
    x, some = problem.structure.start, np.arange(plant.frequency_hz.size) % 17 == 0
    value, slope = problem.only(some).sloped_clearances(x)
    np.testing.assert_allclose(value, problem.clearances(x)[:, some], rtol=1e-12)
    tracking, bend = problem.tracking(x)
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = 1e-6
        moved = problem.clearances(x + step)[:, some]
        np.testing.assert_allclose(slope[..., i], (moved - value) / 1e-6, atol=1e-4)
        np.testing.assert_allclose(bend[:, i], (problem.tracking(x + step)[0] - tracking) / 1e-6, atol=1e-2, rtol=1e-4)
        rise = np.log(problem.noise_gain(x + step)[0] / problem.noise_gain(x)[0]) / 1e-6
        np.testing.assert_allclose(problem.noise_gain(x)[1][i], rise, atol=1e-4)


@pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")  # python-control with NumPy 2.5
@given(st.floats(0.2, 5.0), st.floats(0.05, 0.9), st.floats(0.2, 3.0))
@settings(max_examples=30, deadline=None)
def test_disk_margins_are_those_of_python_control(gain: float, damping: float, corner: float) -> None:
    loop = control.tf([gain], [1.0, 1.0]) * control.tf([corner**2], [1.0, 2 * damping * corner, corner**2])
    omega = np.geomspace(1e-2, 1e2, 2000)
    known = float(control.disk_margins(loop, omega)[0])
    assert disk_margin(loop(1j * omega)) == pytest.approx(known, rel=1e-3)


def test_a_required_bandwidth_is_promised_with_larger_margins_than_the_highest() -> None:
    machine = next(machines(1))
    highest = proposed(machine, 0.05, 0)
    assert highest is not None
    less = LoopSpecification(bandwidth_hz=0.5 * highest.promised.bandwidth_hz)
    found = proposed(machine, 0.05, 0, less)
    assert found is not None
    assert found.met
    assert found.promised.max_sensitivity < highest.promised.max_sensitivity
    assert keeps(true_margins(machine, found), found.promised)


def test_a_specification_that_no_controller_meets_gives_the_best_and_what_limits_it() -> None:
    found = proposed(next(machines(1)), 0.05, 0, LoopSpecification(bandwidth_hz=500.0))
    assert found is not None
    assert not found.met
    assert found.limited_by
    assert "no controller of this structure promises a bandwidth of 500 Hz: the best promises" in found.sentence


def test_every_place_keeps_the_limits() -> None:
    """Two machines with resonances apart: one controller for both."""
    one, two = (machine for machine, _ in zip(machines(3), range(2)))
    rows = [measured(machine, 0.05, 0) for machine in (one, two)]
    scale = np.abs(rows[0].value[:, :1] / rows[1].value[:, :1])
    value = np.concatenate([rows[0].value, rows[1].value * scale])
    sigma = np.concatenate([rows[0].sigma, rows[1].sigma * scale])
    ones, row = np.ones(value.shape), np.zeros(2, dtype=np.int64)
    both = Responses(rows[0].lines, value, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)
    found = tune(both, one.loop, LIMITS, loop_checked=True)
    assert found.promised.max_sensitivity <= LIMITS.max_sensitivity + 1e-3
    assert found.promised.gain_margin_db >= LIMITS.gain_margin_db - 0.01
    assert found.promised.phase_margin_deg >= LIMITS.phase_margin_deg - 0.01


def test_it_refuses_an_unchecked_loop_low_coherence_and_missing_lines() -> None:
    machine = next(machines(1))
    responses = measured(machine, 0.05, 0)
    with pytest.raises(TuneError, match="not checked"):
        tune(responses, machine.loop, loop_checked=False)
    f = responses.lines.frequency_hz
    low = Responses(
        responses.lines, responses.value, responses.sigma, responses.dof, 0.1 * np.ones((1, f.size)), responses.valid,
        responses.first, responses.sample, responses.time_s, responses.schedule,
    )  # fmt: skip
    with pytest.raises(TuneError, match="coherence") as refusal:
        tune(low, machine.loop, loop_checked=True)
    assert refusal.value.code == "tune.coherence-low"
    with pytest.raises(TuneError, match="add the lines") as refusal:
        tune(selected(responses, (f < 6) | (f > 150)), machine.loop, loop_checked=True)
    assert refusal.value.code == "tune.lines-missing"
    Lines.parse(refusal.value.lines, 4000.0, 40000, rounded=True)
    with pytest.raises(TuneError, match="only PID, Cascade and PositionPD"):
        tune(responses, Loop(2.0 * VELOCITY), loop_checked=True)


def test_the_filters_as_text_contain_the_coefficients() -> None:
    found = proposed(next(machines(1)), 0.05, 0)
    assert found is not None
    header, text = c_header(found.feedback.biquads), structured_text(found.feedback.biquads)
    for biquad in found.feedback.biquads:
        for x in (*biquad.b, *biquad.a):
            assert repr(x) in header
            assert repr(x) in text or "e" in repr(x)
