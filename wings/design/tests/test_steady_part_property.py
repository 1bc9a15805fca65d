"""The steady part of what was recorded, and where the excitation was interrupted."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from livebode_design.playback import steady_part


@given(
    window=st.integers(8, 40), before=st.integers(0, 90), periods=st.integers(5, 12), shift=st.integers(0, 39),
    seed=st.integers(0, 99), lost=st.booleans(),
)  # fmt: skip
def test_the_steady_part_is_found_and_ends_where_the_excitation_was_interrupted(
    window: int, before: int, periods: int, shift: int, seed: int, lost: bool
) -> None:
    period = np.random.default_rng(seed).uniform(0.2, 1, window) * np.resize([1, -1], window)
    steady = np.roll(period, shift)[np.arange(periods * window) % window]
    played = np.concatenate([np.zeros(before), steady, np.zeros(before)])
    if lost:
        played[before + periods * window // 2 + window] = 0.0
    first, last = steady_part(played, period)
    if lost:
        assert last - first < periods * window
        np.testing.assert_array_equal(played[first:last], steady[first - before : last - before])
    else:
        assert (first, last) == (before, before + periods * window)
