"""Roots and minima in brackets, for functions whose answer is known."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.analysis.crossings import find_minima, find_roots

places = st.lists(st.floats(0.1, 9.9), min_size=1, max_size=20).map(np.array)


@given(places, st.sampled_from([1.0, -1.0]), st.floats(0.01, 30.0))
@settings(max_examples=50, deadline=None)
def test_every_row_has_its_own_root(truth: np.ndarray, sign: float, bend: float) -> None:
    low, high = np.zeros(truth.size), np.full(truth.size, 10.0)
    found = find_roots(lambda x: sign * np.expm1(bend * (x - truth)), low, high, 1e-12)
    np.testing.assert_allclose(found, truth, rtol=1e-9)


@given(places)
@settings(max_examples=25, deadline=None)
def test_a_root_is_found_where_an_end_is_infinite(truth: np.ndarray) -> None:
    def function(x: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore"):
            return np.log((10 - x) / (10 - truth))

    found = find_roots(function, np.zeros(truth.size), np.full(truth.size, 10.0), 1e-12)
    np.testing.assert_allclose(found, truth, rtol=1e-9)


@given(places)
@settings(max_examples=25, deadline=None)
def test_a_minimum_between_the_ends_is_found(truth: np.ndarray) -> None:
    found = find_minima(lambda x: np.abs((x - truth) + 0.3j), np.zeros(truth.size), np.full(truth.size, 10.0), 1e-4)
    np.testing.assert_allclose(found, truth, atol=1e-8)


def test_no_rows_have_no_roots_and_no_minima() -> None:
    nothing = np.zeros(0)
    assert find_roots(np.sin, nothing, nothing, 1e-9).size == 0
    assert find_minima(np.sin, nothing, nothing, 1e-9).size == 0
