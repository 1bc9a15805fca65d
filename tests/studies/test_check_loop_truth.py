"""The check of a loop's description finds each wrong word, and nothing in a right description."""

from __future__ import annotations

import pytest

from studies.check_loop import AXES, Axis, false_alarms, shares, words

RUNS = 40
FALSE_TESTED = [AXES[0], AXES[2], AXES[3]]


@pytest.mark.parametrize("axis", FALSE_TESTED, ids=lambda axis: axis.name)
def test_a_right_description_is_as_described(axis: Axis) -> None:
    """At 0.4 % a run, two alarms in 40 runs have a probability of 1.1 %."""
    assert false_alarms(axis, RUNS, seed=11) <= 1 / RUNS


@pytest.mark.parametrize("number", range(7))
def test_each_wrong_word_is_named(number: int) -> None:
    """95 % are promised; fewer than 9 of 10 have a probability of 9 % at that share, and these are near 100 %."""
    word = list(words(AXES[0].drive))[number]
    found = shares(AXES[0], word, 10, seed=20 + number)
    assert found["named"] >= 0.9, (word.name, found)
    assert found["noticed"] >= found["named"]


def test_the_integrator_rule_is_named_where_the_steps_of_the_encoder_repeat() -> None:
    """Without the images of the position loop, it was named in 75 % and a right description rejected in 6 %."""
    word = next(word for word in words(AXES[2].drive) if word.name == "integrator rule")
    assert shares(AXES[2], word, 10, seed=40)["named"] >= 0.9
