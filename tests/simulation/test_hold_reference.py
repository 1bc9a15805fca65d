"""The hold of a linear system is SciPy's exponential of a matrix, and exact where a formula has it."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from livebode.simulation.hold import held


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(1e-4, 3.0))
@settings(max_examples=50, deadline=None)
def test_a_held_system_is_the_exponential_of_its_block(seed: int, states: int, seconds: float) -> None:
    block = np.zeros((states + 1, states + 1))
    block[:states] = np.random.default_rng(seed).standard_normal((states, states + 1))
    a, b = held(block[:states, :states], block[:states, states], seconds)
    exact = expm(block * seconds)
    scale = np.abs(exact).max()
    np.testing.assert_allclose(a, exact[:states, :states], atol=1e-12 * scale)
    np.testing.assert_allclose(b, exact[:states, states], atol=1e-12 * scale)


def test_a_stiff_decay_is_exact() -> None:
    a, b = held(np.array([[-1e6]]), np.array([1e6]), 1e-6)
    np.testing.assert_allclose([a[0, 0], b[0]], [np.exp(-1), 1 - np.exp(-1)], rtol=1e-14)
