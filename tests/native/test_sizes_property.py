"""The largest sizes of stretches are those that NumPy finds, with every instruction set."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import instruction_sets, largest_sizes

SPECIAL = [np.nan, -np.nan, np.inf, -np.inf, -0.0, 5e-324, -1.7e308]


def by_numpy(samples: np.ndarray, begun: int, window: int) -> np.ndarray:
    parts = np.split(np.abs(samples), range(begun, samples.shape[1], window), axis=1)
    return np.array([part.max(axis=1, initial=0.0) for part in parts]).T


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(instruction_sets()),
    st.integers(0, 150),
    st.integers(1, 40),
    st.integers(1, 70),
    st.sampled_from([slice(None), slice(None, None, -1), slice(0, 2)]),
    st.sampled_from([0.0, 0.01, 0.3]),
    st.integers(0, 2**32 - 1),
)
def test_largest_sizes_are_those_of_numpy(name, count, begun, window, rows, special, seed):
    rng = np.random.default_rng(seed)
    every = rng.standard_normal((3, count + 1))
    places = rng.random(every.shape) < special
    every[places] = rng.choice(SPECIAL, np.count_nonzero(places))
    samples = every[rows, 1:]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIVEBODE_INSTRUCTION_SET", name)
        np.testing.assert_array_equal(largest_sizes(samples, begun, window), by_numpy(samples, begun, window))


def test_samples_that_are_not_contiguous_have_the_same_sizes():
    samples = np.arange(24.0).reshape(2, 12)[:, ::2]
    np.testing.assert_array_equal(largest_sizes(samples, 4, 3), by_numpy(samples, 4, 3))


def test_a_stretch_without_samples_is_refused():
    with pytest.raises(ValueError, match="array"):
        largest_sizes(np.zeros((2, 9)), 0, 4)


def test_samples_of_another_type_are_refused():
    with pytest.raises(ValueError, match="array"):
        largest_sizes(np.zeros((2, 9), np.float32), 4, 4)
