"""Fits of several axes in one computation are those of each axis by itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Event, Lines, Parameters, Responses, SignalError
from livebode.fitting import EvaluationGrid, Fitter, PhysicalModel, Rigid, TwoMass, fit_each
from tests.support.errors import refused
from tests.support.fitted import LINES, TRUTH, noisy

BELT = TwoMass(radius_m=0.019)
OTHERS = Lines.parse("20:120:4", rate_hz=4000, window=1000)
ROWS = 36


def axis(softer: float, lines: Lines, late_s: float, silent: int) -> Responses:
    """A machine with its own stiffness and delay, of which some rows have no response."""
    values = np.repeat(TRUTH[np.newaxis], ROWS, axis=0)
    values[:, 2] *= softer * np.linspace(1.0, 1.2, ROWS)
    values[:, -1] = late_s
    found = noisy(BELT.at(values, EvaluationGrid.of(lines)), lines, 0.01, ROWS)
    value = found.value.copy()
    value[silent : silent + 3] = np.nan
    return Responses(**{**vars(found), "value": value, "valid": np.isfinite(value)})


HALL = [
    axis(1.0, LINES, 0.0, 5), axis(0.8, LINES, 0.0, 20), axis(1.1, LINES, 4e-4, 30), axis(0.9, OTHERS, 0.0, 12),
    axis(1.0, LINES, 0.0, 0), axis(1.05, OTHERS, 0.0, 38),
]  # fmt: skip
MODELS: list[PhysicalModel] = [BELT, BELT, BELT, BELT, Rigid(), BELT]


def same(one: Parameters, other: Parameters) -> None:
    assert list(one.status) == list(other.status)
    for name in ("value", "sigma", "epsilon", "chi2"):
        assert np.allclose(getattr(one, name), getattr(other, name), rtol=1e-6, atol=1e-12, equal_nan=True), name


@given(st.lists(st.lists(st.integers(0, 12), min_size=6, max_size=6), min_size=2, max_size=3))
@settings(max_examples=4, deadline=None)
def test_each_axis_gets_what_it_would_get_alone(steps: list[list[int]]) -> None:
    together, alone = ([Fitter(model) for model in MODELS] for _ in range(2))
    at = [0] * len(HALL)
    events: list[list[Event]] = [[] for _ in HALL]
    expected: list[list[Event]] = [[] for _ in HALL]
    for step in steps:
        batches = [every[a : a + n] for every, a, n in zip(HALL, at, step)]
        found, errors = fit_each(together, batches, [one.append for one in events])
        assert not errors
        for i, fitter in enumerate(alone):
            same(found[i], fitter.process(batches[i], expected[i].append))
        at = [a + n for a, n in zip(at, step)]
    assert [[e.message for e in one] for one in events] == [[e.message for e in one] for one in expected]


def test_an_axis_that_cannot_be_fitted_is_refused_as_alone() -> None:
    loop = Responses(**{**vars(HALL[1]), "quantity": "open loop"})
    found, errors = fit_each([Fitter(BELT), Fitter(BELT)], [HALL[0], loop])
    assert list(found) == [0]
    with refused(SignalError, "wrong-quantity"):
        raise errors[1]


def test_a_parameter_that_only_one_row_fixes_at_zero_has_no_slope() -> None:
    value, covariance = np.array([[2.0, 0.0], [2.0, 3.0]]), np.zeros((2, 2, 2))
    covariance[:, 0, 0], covariance[1, 1, 1] = 0.01, 0.04
    of = {name: np.zeros(2) for name in ("epsilon", "chi2", "dof", "time_s", "schedule")}
    fits = Parameters(
        "line", ("a", "b"), ("", ""), value, covariance, status=np.array(["ok", "ok"]), sample=np.arange(2), **of
    )
    found = fits.derived(["sum"], [""], lambda x: x.sum(axis=-1, keepdims=True))
    assert found.sigma.ravel() == pytest.approx([0.1, np.hypot(0.1, 0.2)])
