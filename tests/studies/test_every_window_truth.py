"""Faults that are the same in every window: short forms of `python -m studies.every_window`."""

from __future__ import annotations

import pytest

from studies.every_window import measure


def test_a_recording_without_a_fault_is_right() -> None:
    # Of these two cases some 60 lines with a correct bound of 98 %: a case is wrong once in 50.
    assert [verdict.word for verdict in measure(["healthy"], 2, 0)["healthy"]] == ["right", "right"]


@pytest.mark.parametrize("kind", ["creep", "bent creep", "random walk", "wander", "wrap"])
def test_slow_signals_are_right(kind: str) -> None:
    assert [verdict.word for verdict in measure([kind], 2, 2)[kind]] == ["right", "right"]
