"""What is played never exceeds the design, has no step, and ends at zero, whenever it is stopped."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from livebode_drives.players.hal import Programme


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
