"""When states are stored: their share of the bytes, and what a takeover computes again."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from livebode_plant.fleet.partition import REPLAY_S_MAX, STATE_S_MIN, STATE_SHARE, StoredStates

STEP_S, BLOCK_BYTES = 0.5, 24_000


class _Owner:
    """An owner whose axes each take a message every half second, on a clock of its own."""

    def __init__(self, axes: int, state_bytes: int, computed_s: float) -> None:
        self.now_s, self.state_bytes, self.computed_s = 0.0, state_bytes, computed_s
        self.states = StoredStates(lambda: self.now_s)
        self.keys = [f"axis {number}" for number in range(axes)]
        self.stored_s: dict[str, list[float]] = {key: [] for key in self.keys}

    def step(self) -> None:
        self.now_s += STEP_S
        for key in self.keys:
            self.states.processed(key, BLOCK_BYTES, self.computed_s)
        for key in self.states.due():
            self.states.stored(key, self.state_bytes)
            self.stored_s[key].append(self.now_s)


@given(st.integers(1, 60), st.integers(1_000, 3_000_000), st.floats(1e-5, 3e-3))
@settings(max_examples=20, deadline=None)
def test_a_replay_is_short_or_states_are_few_and_never_two_within_their_least_time(
    axes: int, state_bytes: int, computed_s: float
) -> None:
    owner = _Owner(axes, state_bytes, computed_s)
    young_s = (STATE_S_MIN + STEP_S) / STEP_S * axes * computed_s
    for _ in range(200):
        owner.step()
        assert owner.states.replay_s <= max(REPLAY_S_MAX, young_s) + 1e-9
    for times in owner.stored_s.values():
        assert all(later - sooner >= STATE_S_MIN for sooner, later in pairwise(times))
    if 200 * axes * computed_s <= REPLAY_S_MAX:  # without the second rule
        states = sum(map(len, owner.stored_s.values())) * state_bytes
        assert states <= STATE_SHARE * 200 * axes * BLOCK_BYTES + axes * state_bytes


def test_large_states_are_stored_before_they_are_few_and_not_all_at_once() -> None:
    owner = _Owner(axes=40, state_bytes=650_000, computed_s=0.005)
    most = 0
    for _ in range(400):
        before = sum(map(len, owner.stored_s.values()))
        owner.step()
        most = max(most, sum(map(len, owner.stored_s.values())) - before if owner.now_s > 20 else 0)
    assert owner.states.replay_s <= REPLAY_S_MAX
    assert 0 < most < 10


def test_a_restored_axis_whose_state_was_small_is_stored_soon() -> None:
    owner = _Owner(axes=1, state_bytes=1_000, computed_s=0.001)
    owner.states.restored("axis 0", 1_000)
    owner.step()
    assert owner.stored_s["axis 0"] == [STEP_S]
