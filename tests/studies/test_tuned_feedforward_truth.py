"""Feedforward from a measurement: inertia and friction of the simulated axis, and the tracking error that it leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from livebode.core import Lines, Responses, SignalError
from livebode.fitting import EvaluationGrid, TwoMass
from livebode_control.tuning.feedforward import rigid_inertia
from studies.tune_feedforward import compared

TRUE_KG_M2 = 0.0028 + 6.7 * 0.019**2


def responses(lines: Lines, share: float | np.ndarray, seed: int) -> Responses:
    """Of the belt of Table I, with this sigma over |G|."""
    model = TwoMass(radius_m=0.019)
    values = [{"Js": 0.0028, "mL": 6.7, "Keff": 5e5, "bs": 130.0}.get(name, 0.0) for name in model.names]
    truth = np.atleast_2d(model.at(values, EvaluationGrid.of(lines)))
    noise = np.random.default_rng(seed).standard_normal((2, *truth.shape)) / np.sqrt(2)
    sigma, ones, row = share * np.abs(truth), np.ones(truth.shape), np.zeros(1, dtype=np.int64)
    value = truth + sigma * (noise[0] + 1j * noise[1])
    return Responses(lines, value, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)


def test_the_bound_of_the_inertia_covers_it() -> None:
    """Of 100 runs at least 88 (95 expected; fewer than 88 with 0.2 %)."""
    lines = Lines.parse("2:160:2", 4000.0, 2000)
    found = np.array([rigid_inertia(responses(lines, 0.02, seed), "velocity") for seed in range(100)])
    assert np.count_nonzero(np.abs(found[:, 0] - TRUE_KG_M2) <= found[:, 1]) >= 88
    assert np.median(found[:, 1]) < 0.1 * TRUE_KG_M2
    with pytest.raises(SignalError, match="excite lower lines"):
        rigid_inertia(responses(Lines.parse("30:160:2", 4000.0, 2000), 0.02, 0), "velocity")


def test_the_bound_covers_the_inertia_where_the_model_is_wrong_and_three_lines_have_little_noise() -> None:
    """The plant is 1 % beside two masses, not known to sigma. Of 100 runs at least 88, as above."""
    lines = Lines.parse("2:160:2", 4000.0, 2000)
    share = np.where(np.isin(lines.frequency_hz, (6, 12, 18)), 1e-5, 1e-2)
    covered = 0
    for seed in range(100):
        one = responses(lines, np.hypot(share, 1e-2), seed)
        inertia, bound = rigid_inertia(replace(one, sigma=share * np.abs(one.value)), "velocity")
        covered += abs(inertia - TRUE_KG_M2) <= bound
    assert covered >= 88


def test_feedforward_reduces_the_tracking_error() -> None:
    for one in compared(2):
        assert one.after_rad < 0.3 * one.before_rad
        assert abs(one.inertia_error) < 0.03
