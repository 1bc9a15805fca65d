"""Cubic splines over a position, in C, have the bits of SciPy's BSpline."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from livebode.kernel import CurveShape, curve_at, curve_splines


@settings(max_examples=100, deadline=None)
@given(
    splines=st.integers(4, 12),
    low=st.floats(-3, 3),
    way=st.floats(1e-3, 3),
    places=st.integers(0, 50),
    in_order=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_curves_have_the_bits_of_scipy(
    splines: int, low: float, way: float, places: int, in_order: bool, seed: int
) -> None:
    rng, high, reach = np.random.default_rng(seed), low + way, 0.1 * way
    knots = np.concatenate([np.full(3, low), np.linspace(low, high, splines - 2), np.full(3, high)])
    weights, slopes = rng.normal(size=splines), rng.normal(size=2)
    x = np.concatenate([knots, rng.uniform(low - 0.3 * way, high + 0.3 * way, size=places)])
    x = np.sort(x) if in_order else rng.permutation(x)
    within = x.clip(low, high)
    straight = (x - low).clip(-reach, 0.0) * slopes[0], (x - high).clip(0.0, reach) * slopes[1]
    value = BSpline(knots, weights, 3)(within) + straight[0] + straight[1]
    shape = CurveShape(knots, weights, reach, *slopes.tolist())
    assert curve_at(shape, x).tobytes() == value.tobytes()
    found = curve_splines(knots, x) + 0.0  # a sparse matrix loses the sign of a zero
    assert found.tobytes() == BSpline.design_matrix(within, knots, 3).toarray().tobytes()


def test_too_few_knots_are_refused() -> None:
    with pytest.raises(ValueError, match="eight knots"):
        curve_splines(np.arange(7.0), np.zeros(3))
