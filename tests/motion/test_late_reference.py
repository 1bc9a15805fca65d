"""A signal by a part of a sample later: SciPy's spline, bit for bit, whatever the other rows are."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import shift

from livebode.motion import late


@given(
    rows=st.integers(1, 19),
    ticks=st.sampled_from([1, 2, 3, 13, 40, 400, 700]),
    samples=(st.floats(-40, 40) | st.floats(-1e-3, 1e-3) | st.integers(-3, 3).map(float)).filter(bool),
    seed=st.integers(0, 1000),
    rest=st.integers(0, 30),
)
@settings(max_examples=80, deadline=None)
def test_rows_are_shifted_as_by_scipy(rows: int, ticks: int, samples: float, seed: int, rest: int) -> None:
    signals = np.random.default_rng(seed).standard_normal((rows, ticks)).cumsum(axis=1)
    signals[:, :rest] = 0.0  # as a model that begins at rest
    expected = [shift(row, samples, order=3, mode="nearest") for row in signals]
    assert np.array_equal(late(signals, samples), expected)
    assert np.array_equal(late(signals[-1], samples), expected[-1])
    assert late(signals, 0.0) is signals
