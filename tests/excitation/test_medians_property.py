"""The median by sorting is NumPy's, to the bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from livebode.excitation import medians

_FLOATS = st.floats(allow_nan=True, allow_infinity=True, width=64)


@given(st.data(), st.integers(1, 9), st.integers(1, 9), st.sampled_from([0, 1]))
def test_medians_are_those_of_numpy(data: st.DataObject, rows: int, columns: int, axis: int) -> None:
    x = data.draw(arrays(np.float64, (rows, columns), elements=_FLOATS))
    with np.errstate(all="ignore"):
        found, expected = medians(x, axis), np.median(x, axis=axis)
    # The sign of a zero depends on the order of equal values, which neither of them defines.
    np.testing.assert_array_equal(found, expected)


@given(st.data(), st.integers(2, 70), st.sampled_from([0, 1]))
def test_a_median_has_the_bits_of_numpy_where_no_value_is_zero(data: st.DataObject, count: int, axis: int) -> None:
    seed = data.draw(st.integers(0, 2**32 - 1))
    x = np.random.default_rng(seed).standard_normal((count, 5) if axis == 0 else (5, count))
    assert medians(x, axis).tobytes() == np.median(x, axis=axis).tobytes()
