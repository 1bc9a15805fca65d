"""The picture of a proposal has the panels that were asked for, with the numbers of the proposal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from livebode.core import PID, Lines, Loop, Responses
from livebode.fitting import EvaluationGrid, TwoMass
from livebode.motion import FrictionCurve
from livebode.pictures import Trace, svg_file
from livebode_control.proposal.tuning_picture import tuning_figure
from livebode_control.tuning import ControllerProposal, LoopSpecification, tune
from livebode_control.tuning.feedforward import Feedforward
from livebode_control.tuning.gain_schedule import GainSchedule, gain_schedule
from tests.support.drawn_svg import checked

RATE_HZ = 4000.0
LOOP = Loop(PID(gain=0.2, integral_time_s=0.2, rate_hz=RATE_HZ, delay_ticks=4))
SPECIFICATION = LoopSpecification(encoder_step=2 * np.pi / 2**17, input_noise=0.1)


@pytest.fixture(scope="module")
def responses() -> Responses:
    """Three places of a belt, known exactly."""
    lines = Lines.parse("2:400:2", rate_hz=RATE_HZ, window=2000)
    model = TwoMass(radius_m=0.019)
    belts = ({"Js": 0.0028, "mL": 6.7, "Keff": k, "bs": 130.0} for k in (4e5, 5e5, 6e5))
    plant = model.at([[one.get(name, 0.0) for name in model.names] for one in belts], EvaluationGrid.of(lines))
    ones, row = np.ones(plant.shape), np.zeros(3, dtype=np.int64)
    return Responses(lines, plant, 0 * ones, row + np.inf, ones, ones > 0, row, row, row + 0.0, np.arange(3.0))


@pytest.fixture(scope="module")
def found(responses: Responses) -> ControllerProposal:
    return tune(responses, LOOP, SPECIFICATION, loop_checked=True)


@pytest.fixture(scope="module")
def gains(responses: Responses) -> GainSchedule:
    return gain_schedule(responses, LOOP, SPECIFICATION, loop_checked=True)


@pytest.fixture(scope="module")
def forward() -> Feedforward:
    names, units = ("inertia", "viscous", "coulomb", "offset"), ("kg m²", "N m/(rad/s)", "N m", "N m")
    root = np.array([[1e-5, 0, 0, 0], [0, 1e-4, -2e-3, 0], [0, 1e-4, 3e-3, 0], [0, 0, 0, 1e-3]])
    covariance, dof = root @ root.T, np.full(4, 20)
    measured = np.array([[-20.0, 20.0], [-0.3, 0.3]])
    value = np.array([0.005, 0.01, 0.1, 0.02])
    curve = FrictionCurve(names, units, value, covariance, dof, np.empty(0), (1.0, 20.0), 0.01, 100, 0, measured)
    return Feedforward(0.005, 1e-4, 0.01, 1e-3, 0.1, 1e-2, 0.02, 1e-2, curve)


def test_below_is_what_was_asked_for(found: ControllerProposal, gains: GainSchedule, forward: Feedforward) -> None:
    figure = tuning_figure(found, gains=gains, feedforward=forward)
    checked(svg_file(figure))
    noise, scheduled, bandwidths, friction = (
        {mark.name: mark for mark in panel.marks if isinstance(mark, Trace)} for panel in figure.panels[-4:]
    )
    assert (noise["before"].y[-1], noise["proposed"].y[-1]) == pytest.approx(found.noise)
    assert noise["limit"].y[0] == SPECIFICATION.input_noise
    for name, column in zip(gains.names, (gains.logarithms - gains.common_logarithms).T):
        assert scheduled[name].x.tolist() == [0, 1, 2]
        np.testing.assert_allclose(scheduled[name].y, np.exp(column))
    for name, promised in (("before", gains.common_promised), ("proposed", gains.promised)):
        assert list(bandwidths[name].y) == [one.bandwidth_hz for one in promised]
    assert "0.005" in figure.panels[-1].title
    assert "friction" in friction


def test_nothing_is_added_without_being_asked_for(responses: Responses) -> None:
    plain = tune(responses, LOOP, loop_checked=True)
    assert len(tuning_figure(plain, feedforward=Feedforward(0.005, 1e-4)).panels) == 6


def test_friction_and_its_bound_are_those_of_the_curve(forward: Feedforward) -> None:
    assert forward.curve is not None
    for sign in (-1, 1):
        v = sign * np.linspace(1.0, 20.0, 5)
        expected: Any = forward.curve.at(v)
        np.testing.assert_allclose(forward.friction(v, sign), expected)
