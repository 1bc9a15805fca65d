"""Faults that are the same in every window: short forms of `python -m studies.every_window`."""

from __future__ import annotations

from studies.every_window import measure


def test_a_recording_without_a_fault_is_right() -> None:
    # Of these two cases some 60 lines with a correct bound of 98 %: a case is wrong once in 50.
    assert [verdict.word for verdict in measure(["healthy"], 2, 0)["healthy"]] == ["right", "right"]
