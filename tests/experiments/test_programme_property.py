"""What is played never exceeds the design, has no step, and ends at zero, whenever it is stopped."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from livebode.experiments.measuring.programme import Programme
from livebode.experiments.measuring.steady_part import steady_part


@given(
    window=st.integers(4, 60), up=st.integers(1, 200), down=st.integers(2, 200), stop=st.integers(0, 500),
    piece=st.integers(1, 97), seed=st.integers(0, 99),
)  # fmt: skip
def test_a_programme_in_pieces_is_the_period_between_ramps(
    window: int, up: int, down: int, stop: int, piece: int, seed: int
) -> None:
    period = np.random.default_rng(seed).uniform(-1, 1, window)
    programme = Programme(period, up, down)
    sent: list[float] = []
    while len(sent) < stop:
        sent += programme.samples(len(sent), min(len(sent) + piece, stop)).tolist()
    assert programme.stop(stop) == programme.stop(0) == stop + down
    while taken := programme.samples(len(sent), len(sent) + piece).tolist():
        sent += taken
    played = np.array(sent)
    assert played.size == stop + down
    assert played[-1] == 0.0
    number = np.arange(played.size)
    assert np.all(np.abs(played) <= np.abs(period[number % window]))
    steady = slice(up, stop)
    np.testing.assert_array_equal(played[steady], period[number % window][steady])
    # Without the period there are only slopes: nothing is switched off at once.
    envelope = Programme(np.ones(1), up, down)
    envelope.stop(stop)
    assert np.all(np.abs(np.diff(envelope.samples(0, 1 << 20))) <= 1 / up + 1 / down + 1e-12)


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
