"""The check of a loop's description finds each wrong word, and nothing in a right description."""

from __future__ import annotations

from dataclasses import replace

import pytest

from studies.check_loop import AXES, Axis, checks, false_alarms, shares, words

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


@pytest.mark.parametrize("position", [2, 8])
def test_a_velocity_loop_that_is_slower_than_the_recording_is_as_described(position: int) -> None:
    """Before, the steps of the encoder that it folds onto the lines contradicted every description."""
    drive = replace(AXES[1].drive, velocity_ticks=2, position_ticks=position)
    assert not false_alarms(replace(AXES[1], drive=drive), 4, seed=70)


@pytest.mark.parametrize(("velocity", "ticks"), [(1, 4), (1, 16), (2, 8)])
@pytest.mark.parametrize("left_out", [True, False], ids=["left out", "at another rate"])
def test_the_rate_of_a_position_loop_is_named(velocity: int, ticks: int, left_out: bool) -> None:
    """Before, only the rate of the recording and half of it were tried: none of these was named, and a gain was."""
    axis = AXES[0]
    drive = replace(axis.drive, velocity_ticks=velocity, position_ticks=ticks)
    right = drive.described()
    assert right.position is not None
    other = right.position.model_copy(update={"rate_divider": 2, "rate_hz": axis.lines.rate_hz / 2})
    described = right.model_copy(update={"position": None if left_out else other})
    (found,) = checks(axis, drive, described, 1, seed=60 + ticks)
    rate = f"loop.position (rate_divider {ticks}).gain" if left_out else "loop.position.rate_divider"
    assert found.verdict == "one change"
    assert any(one.change.key == rate and (left_out or one.value == ticks) for one in found.explanations)
