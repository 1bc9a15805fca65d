"""Images of a position loop at a lower rate are part of the equation of a loop, as a drive computes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from livebode.core import PID, Block, Cascade, Gain, Lines, PositionPD
from livebode.excitation import multisine
from livebode_control.loop_check.loop_equation import LoopSignals
from livebode_control.loop_check.loop_images import held_paths
from studies.loop_words import Drive, Machine, record

LINES = Lines.parse("20:140:20", 4000, 400)


@pytest.mark.parametrize(("velocity", "ticks"), [(1, 2), (1, 4), (2, 2), (2, 8), (4, 4)])
@pytest.mark.parametrize("first", [0, 1])
def test_the_equation_is_exact_with_the_images_of_an_encoder_of_few_counts(
    velocity: int, ticks: int, first: int
) -> None:
    """Without noise, the steps of the encoder repeat; the remainder is then that of the Hann window.

    A slower velocity loop folds the whole noise of the encoder, which is a hundred times more.
    """
    drive = Drive(velocity_ticks=velocity, position_gain=30.0, position_ticks=ticks)
    machine = Machine(counts_per_turn=2048, cogging_n_m=0.1)
    w, u, y = (np.atleast_2d(signal)[0][first:] for signal in record(drive, machine, 0.3 * multisine(LINES), 12, 1, 1))
    signals = LoopSignals.of(
        Block(np.stack([w, u, y]), ("w", "u", "y"), 4000.0), LINES, excitation="w", input="u", output="y"
    )
    loop = drive.described().build(4000.0)
    best = min((signals.judge(loop, phase) for phase in range(ticks)), key=lambda one: one.deviance)
    plain = signals.judge(replace(loop, feedback=_without_images(loop.feedback)))
    rest, without = (np.linalg.norm(one.value) / np.linalg.norm(one.largest) for one in (best, plain))
    print(f"{velocity}, {ticks} ticks from {first}: {rest:.2g} with images, {without:.2g} without")
    assert rest < max(2e-5, 2e-3 * without)
    assert without > 10 * rest


def _without_images(feedback: object) -> object:
    """The same response of a loop whose images are not known: a sum of two models."""
    assert isinstance(feedback, Cascade)
    return feedback + Gain(0.0)


def test_controllers_that_hold_nothing_have_no_images() -> None:
    slow = PID(gain=1.0, rate_hz=500, rate_divider=2)
    assert held_paths(PID(gain=1.0, rate_hz=1000)) == ()
    assert held_paths(replace(slow, hold="none")) == ()
    assert held_paths(None) == ()
    fast = PID(gain=1.0, rate_hz=1000)
    assert held_paths(Cascade(fast, fast)) == held_paths(Cascade(fast, replace(slow, hold="none"))) == ()
    (found,) = held_paths(PositionPD(position_gain=2.0, velocity_gain=3.0, rate_hz=500, rate_divider=2, delay_ticks=1))
    assert found.samples.position == "output"
    held = found.samples.images(np.array([1.0, 2.0, 4.0, 8.0, 16.0]), 1000.0, 0)
    assert held.tolist() == pytest.approx([0.0, 1.0 - 1.5, 4.0 - 3.0, 4.0 - 6.0, 16.0 - 12.0], abs=1e-12)
