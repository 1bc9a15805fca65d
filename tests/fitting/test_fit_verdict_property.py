"""A fit has one verdict: what it says of its bounds agrees with its ε, whatever the response."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Lines, Responses
from livebode.fitting import EvaluationGrid, Fit, TwoMass, fit

BELT = TwoMass(radius_m=0.019)
LINES = Lines.parse("20:120:4", rate_hz=4000, window=1000)
EXACT = BELT.at([0.0028, 6.7, 5e5, 130.0, 0, 0, 0], EvaluationGrid.of(LINES))


def fitted(errors: np.ndarray, sigma: float) -> Fit:
    """Two masses with relative errors (lines,), of which the responses say that their sigma is this share of |G|."""
    one, ones = np.zeros(1, dtype=int), np.ones((1, len(LINES)))
    value = (EXACT * (1 + errors))[np.newaxis]
    return fit(
        Responses(LINES, value, sigma * np.abs(value), one + np.inf, ones, ones > 0, one, one, one + 0.0, one + np.nan),
        BELT,
    )


def scatter(size: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return size * (rng.standard_normal(len(LINES)) + 1j * rng.standard_normal(len(LINES))) / np.sqrt(2)


def waves(size: float, seed: int) -> np.ndarray:
    """An error that neighbouring lines share."""
    turns = np.random.default_rng(seed).uniform(2.8, 3.2)
    return size * np.exp(1j * np.linspace(0, 2 * np.pi * turns, len(LINES))).real


@pytest.mark.parametrize("size", [0.002, 0.02, 0.2])
@pytest.mark.parametrize("sigma", [0.001, 0.02, 0.1])
@pytest.mark.parametrize("errors", [scatter, waves])
def test_what_is_said_of_the_bounds_agrees_with_the_model_error(errors, size: float, sigma: float) -> None:  # type: ignore[no-untyped-def]
    for seed in range(2):
        found = fitted(errors(size, seed), sigma)
        if found.status != "ok":
            continue
        words = str(found.about_bounds)
        assert found.complete == words.endswith("± covers 95 %")
        assert found.complete != ("model incomplete" in words)
        if found.complete:
            assert found.epsilon < 0.1
        else:
            assert found.epsilon > 1e-4  # "ε = 0 %" is not beside "model incomplete"


def test_an_error_of_a_third_without_a_pattern_is_not_called_a_95_percent_bound() -> None:
    found = fitted(scatter(0.3, 1), 0.001)
    assert found.status != "ok" or not found.complete


def test_a_pattern_inside_the_noise_widens_the_bounds() -> None:
    """Residuals of a fifth of sigma that neighbours share: ε is their size, not zero, and the bounds contain it."""
    shared = fitted(waves(0.004, 0), 0.02)
    assert shared.correlation is not None
    assert 0.001 < shared.epsilon < 0.02
    for name, truth in (("Js", 0.0028), ("mL", 6.7), ("Keff", 5e5), ("bs", 130.0)):
        assert abs(shared[name] - truth) <= shared.bound(name)
