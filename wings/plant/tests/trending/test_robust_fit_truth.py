"""Robust regression against closed forms and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import linregress

from livebode_plant.trending.robust_fit import robust_fit

X = np.linspace(-1.0, 1.0, 400)
TERMS = np.column_stack([np.ones_like(X), X])
SLOPE = np.array([0.0, 1.0])


def noise(seed: int, correlation: float = 0.0) -> np.ndarray:
    own = np.random.default_rng(seed).standard_normal(len(X))
    out = own.copy()
    for i in range(1, len(out)):
        out[i] = correlation * out[i - 1] + np.sqrt(1 - correlation**2) * own[i]
    return out


def test_without_outliers_slope_and_error_are_nearly_those_of_least_squares() -> None:
    value = 3 + 2 * X + 0.1 * noise(1)
    fit, least = robust_fit(TERMS, value, np.zeros_like(X)), linregress(X, value)
    assert fit.coefficients[1] == pytest.approx(least.slope, abs=0.3 * least.stderr)
    # The bound of the correlation of neighbours, one standard error above zero, widens it by 10 %.
    assert 0.9 * least.stderr < fit.error(SLOPE)[0] < 1.3 * least.stderr


def test_a_third_of_outliers_on_one_side_does_not_move_the_line() -> None:
    value = 3 + 2 * X + 0.1 * noise(2)
    value[::3] += 50.0
    fit = robust_fit(TERMS, value, np.zeros_like(X))
    np.testing.assert_allclose(fit.coefficients, [3, 2], atol=0.06)
    assert not fit.weight[::3].any()


def test_the_error_grows_with_the_correlation_as_in_theory() -> None:
    """For slow scatter of correlation φ, the variance of a slope is larger by (1 + φ)/(1 − φ)."""
    errors = {
        phi: np.median([robust_fit(TERMS, noise(seed, phi), np.zeros_like(X)).error(SLOPE)[0] for seed in range(30)])
        for phi in (0.0, 0.6)
    }
    assert errors[0.6] / errors[0.0] == pytest.approx(2.0, rel=0.12)


def test_runs_with_a_wide_bound_count_less() -> None:
    sigma = np.where(np.arange(len(X)) % 2 == 0, 0.01, 1.0)
    value = 3 + 2 * X + sigma * noise(3)
    fit = robust_fit(TERMS, value, sigma)
    assert fit.error(SLOPE)[0] < 0.7 * robust_fit(TERMS, value, np.zeros_like(X)).error(SLOPE)[0]
    assert fit.error(SLOPE)[0] == pytest.approx(0.01 / np.sqrt((X[::2] ** 2).sum()), rel=0.3)
    assert abs(fit.coefficients[1] - 2) < fit.bound_95(SLOPE)[0]


def test_an_exact_line_is_found_exactly() -> None:
    fit = robust_fit(TERMS, 3 + 2 * X, np.zeros_like(X))
    np.testing.assert_allclose(fit.coefficients, [3, 2], rtol=1e-9)
    assert fit.scatter < 1e-9


@settings(max_examples=20)
@given(scale=st.floats(1e-6, 1e9), offset=st.floats(-100, 100), slope=st.floats(-10, 10), seed=st.integers(0, 99))
def test_units_and_trends_shift_the_result_and_nothing_else(
    scale: float, offset: float, slope: float, seed: int
) -> None:
    value = noise(seed)
    one = robust_fit(TERMS, value, np.zeros_like(X))
    other = robust_fit(TERMS, scale * (value + offset + slope * X), np.zeros_like(X))
    np.testing.assert_allclose(
        other.coefficients, scale * (one.coefficients + np.array([offset, slope])), rtol=1e-3, atol=1e-4 * scale
    )
    np.testing.assert_allclose(other.error(SLOPE), scale * one.error(SLOPE), rtol=1e-3)
