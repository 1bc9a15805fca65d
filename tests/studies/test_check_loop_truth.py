"""The check of a loop's description finds each wrong word, and nothing in a right description."""

from __future__ import annotations

import pytest

from studies.check_loop import AXES, Axis, false_alarms, shares, words

RUNS = 40
PROMISED = [AXES[0], AXES[3]]


@pytest.mark.parametrize("axis", PROMISED, ids=lambda axis: axis.name)
def test_a_right_description_is_as_described(axis: Axis) -> None:
    """At 0.2 % a run, two alarms in 40 runs have a probability of 0.3 %."""
    assert false_alarms(axis, RUNS, seed=11) <= 1 / RUNS


@pytest.mark.parametrize("number", range(7))
def test_each_wrong_word_is_named(number: int) -> None:
    """95 % are promised; below 90 % of 40 a share of 95 % has a probability of 5 %, and these are near 100 %."""
    word = list(words(AXES[0].drive))[number]
    found = shares(AXES[0], word, 20, seed=20 + number)
    assert found["named"] >= 0.9, (word.name, found)
    assert found["noticed"] >= found["named"]
