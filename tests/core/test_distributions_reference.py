"""Tails, quantiles and lengths without SciPy are SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.fft
import scipy.special
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import f_exceeded, f_quantile, fast_length, log_sum_exceeded, sum_exceeded, t_quantile

halves = st.integers(1, 3000)
denominators = st.floats(0.5, 1e6)
chances = st.floats(1e-8, 0.999)


@given(halves, denominators, chances)
@settings(max_examples=100, deadline=None)
def test_a_quantile_of_f_is_scipys_and_is_exceeded_with_its_chance(
    half: int, denominator: float, chance: float
) -> None:
    value = f_quantile(chance, 2 * half, denominator)
    assert scipy.special.fdtrc(2 * half, denominator, value) == pytest.approx(chance, rel=1e-8)
    assert f_exceeded(value, 2 * half, denominator) == pytest.approx(chance, rel=1e-9)


@pytest.mark.parametrize("numerator", [0, 3])
def test_f_with_an_odd_numerator_is_refused(numerator: int) -> None:
    with pytest.raises(ValueError, match="not even"):
        f_exceeded(1.0, numerator, 5)


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_f_is_always_positive(value: float) -> None:
    assert f_exceeded(value, 4, 5.0) == 1


@given(st.floats(0.501, 0.9999), st.integers(1, 400))
@settings(max_examples=50, deadline=None)
def test_a_quantile_of_students_t_is_scipys(probability: float, degrees: int) -> None:
    assert t_quantile(probability, degrees) == pytest.approx(scipy.stats.t.ppf(probability, degrees), rel=1e-8)


@pytest.mark.parametrize("total", [0.0, 1e-9, 0.3, 5.0, 21.0, 300.0, np.inf])
@pytest.mark.parametrize("count", [1, 7, 21, 401])
def test_the_chance_of_a_sum_is_that_of_scipy(count: int, total: float) -> None:
    assert sum_exceeded(count, total) == pytest.approx(scipy.special.gammaincc(count, total), rel=1e-11, abs=1e-300)


@given(st.lists(st.tuples(st.integers(1, 5000), st.floats(0.1, 5.0)), max_size=20))
@settings(max_examples=50, deadline=None)
def test_the_logarithm_of_the_chance_of_rare_sums_is_scipys(sums: list[tuple[int, float]]) -> None:
    count = np.array([n for n, _ in sums], dtype=np.int64)
    total = np.array([n * share for n, share in sums])
    found, rare, expected = log_sum_exceeded(count, total), total > count, scipy.stats.gamma.logsf(total, count)
    known = rare & np.isfinite(expected)  # SciPy's are of a probability that is 0 below 1e-308
    np.testing.assert_allclose(found[known], expected[known], rtol=1e-8, atol=1e-10)
    assert (found[~rare] == 0).all()


@given(st.integers(1, 10**9))
@settings(max_examples=100, deadline=None)
def test_the_fast_lengths_of_real_signals_are_scipys(least: int) -> None:
    assert fast_length(least) == scipy.fft.next_fast_len(least, real=True)
