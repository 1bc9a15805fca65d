"""Fits in C are those of the general path in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from livebode.fitting import EvaluationGrid, Rigid, TwoMass, TwoMassGain
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import fit_rows
from tests.support.fitted import TRUTH

ROWS, RATE_HZ = 12, 4000.0
GRID = EvaluationGrid(np.arange(20.0, 121.0, 5.0), RATE_HZ)


class NumpyRigid(Rigid):
    """A user's model, as far as the kernel knows."""


class NumpyTwoMass(TwoMass):
    """A user's model, as far as the kernel knows."""


class NumpyGain(TwoMassGain):
    """A user's model, as far as the kernel knows."""


@pytest.mark.parametrize("free_delay", [False, True])
@pytest.mark.parametrize(
    ("native", "general", "options", "held"),
    [
        (Rigid, NumpyRigid, {}, {}),
        (TwoMass, NumpyTwoMass, {"radius_m": 0.019}, {}),
        (TwoMass, NumpyTwoMass, {"radius_m": 0.019}, {"B": 0.01, "BL": 8.0}),
        (TwoMass, NumpyTwoMass, {"radius_m": 0.019, "output": "position"}, {"Js": 0.0028}),
        (TwoMass, NumpyTwoMass, {"radius_m": 0.019, "side": "load", "inertia_ratio": 0.9}, {}),
        (TwoMassGain, NumpyGain, {}, {}),
    ],
)
def test_values_bounds_and_status_agree(
    native: Any, general: Any, options: dict[str, Any], held: dict[str, float], *, free_delay: bool
) -> None:
    model, rng = native(**options), np.random.default_rng(5)
    truth = {"rigid": [0.005, 0.0, 0.0], "two-mass-gain": [200.0, 54.0, 76.0, 0.03, 0.02, 0.0]}.get(model.name)
    if truth is None:
        truth = np.delete(TRUTH, 1) if "inertia_ratio" in options else TRUTH
    values = np.array(truth) * rng.uniform(0.9, 1.1, (ROWS, len(truth)))
    for name, value in held.items():
        values[:, model.names.index(name)] = value
    if model.frictions:  # in some rows a friction that explains the error of the model
        values[-4:, -2] = rng.uniform(0.5, 1.0, 4) * (1.0 if model.names[-2] == "B" else 300.0)
    values[:, -1] = 3e-4 if free_delay else 0.0
    truths = np.concatenate([model.at(row[np.newaxis], GRID) for row in values])
    sigma = 0.01 * np.abs(truths)
    value = truths + sigma * (rng.standard_normal(truths.shape) + 1j * rng.standard_normal(truths.shape)) / np.sqrt(2)
    measured, dof = MeasuredRows(value, sigma, rng.random(truths.shape) > 0.1), np.full(ROWS, 12.0)
    one, other = (Problem(of(**options), GRID, held, ["delay"] * free_delay) for of in (native, general))
    assert one.native is not None
    assert other.native is None
    begin = one.with_held(values)
    for start, epsilon in ((None, None), (begin, None), (begin, np.full(ROWS, 1e-3))):
        found, expected = (fit_rows(of, measured, dof, start, epsilon) for of in (one, other))
        assert found.status.tolist() == expected.status.tolist()
        ok = found.status == "ok"
        assert ok.sum() >= 4
        sigma_of = np.sqrt(np.einsum("rii->ri", expected.covariance[ok]))
        assert np.all(np.abs(found.values - expected.values)[ok] <= 1e-4 * sigma_of)
        spread = np.sqrt(np.einsum("rii->ri", found.covariance[ok]))
        assert spread == pytest.approx(sigma_of, rel=1e-4)
        assert found.epsilon == pytest.approx(expected.epsilon, abs=1e-6, nan_ok=True)
        assert found.chi2[ok] == pytest.approx(expected.chi2[ok], rel=1e-3)
