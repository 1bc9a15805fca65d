"""Lines of the time are subtracted where the strokes tell them from orders, and only there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.motion import Shaft, Stroke
from livebode_control.strokes.line_subtraction import without_lines

RATE_HZ, LINE_HZ = 250.0, 20.0
SHAFT = Shaft("motor", 1.0, (6, 24))
ORDER, LINE, NOISE = 0.05, 0.2, 0.05
THREE_SPEEDS = (5 / 6, 1.25, 5 / 3)  # turns a second: order 24 is at 20, 30 and 40 Hz


def _strokes(
    turns_per_s: tuple[float, ...], seed: int, amplitudes: NDArray[np.float64] | None = None
) -> tuple[list[Stroke], list[NDArray[np.float64]]]:
    """Strokes there and back with order 24, a line and noise; and what they are without the line."""
    rng = np.random.default_rng(seed)
    strokes, quiet, first, begin = [], [], 0, 0.3
    for number, speed in enumerate(np.repeat(turns_per_s, 2)):
        samples = round(4 * RATE_HZ / speed)
        time_s = (first + np.arange(samples)) / RATE_HZ
        angle = begin + (-1) ** number * 2 * np.pi * speed * (time_s - time_s[0])
        rest = ORDER * np.cos(24 * angle + 1) + NOISE * rng.normal(size=samples)
        size = LINE if amplitudes is None else amplitudes[number]
        line = size * np.sin(2 * np.pi * LINE_HZ * time_s)
        strokes.append(Stroke(angle, np.stack([rest + line]), first, RATE_HZ))
        quiet.append(rest)
        first, begin = first + samples, float(angle[-1])
    return strokes, quiet


def test_a_line_that_an_order_meets_at_one_of_three_speeds_is_subtracted() -> None:
    strokes, quiet = _strokes(THREE_SPEEDS, seed=0)
    found, remaining = without_lines(strokes, [SHAFT], np.array([LINE_HZ]))
    assert remaining.size == 0
    left = np.concatenate([one.torque[0] for one in found]) - np.concatenate(quiet)
    # The amplitude of a line in n samples of white noise has the standard deviation 2·noise/√n; Hann: times 1.4.
    limit = 3 * 1.4 * 2 * NOISE / np.sqrt(left.size)
    assert np.sqrt(2 * np.mean(left**2)) <= limit


def test_a_line_that_is_an_order_in_every_stroke_remains() -> None:
    strokes, _ = _strokes((5 / 6, 5 / 6), seed=0)
    _, remaining = without_lines(strokes, [SHAFT], np.array([LINE_HZ, 33.0]))
    assert remaining.tolist() == [LINE_HZ]


def test_a_line_of_another_amplitude_in_each_stroke_remains_and_a_constant_one_does_not() -> None:
    """A constant line remains with a probability of 0.1 %: one of 30 with 3 %."""
    varying = np.array([0.1, 0.3, 0.1, 0.3, 0.1, 0.3])
    remaining = [
        without_lines(_strokes(THREE_SPEEDS, seed, sizes)[0], [SHAFT], np.array([LINE_HZ]))[1].size
        for sizes in (varying, None)
        for seed in range(30)
    ]
    assert remaining[:30] == [1] * 30
    assert sum(remaining[30:]) <= 1


def test_without_lines_nothing_changes() -> None:
    strokes, _ = _strokes(THREE_SPEEDS, seed=1)
    found, remaining = without_lines(strokes, [SHAFT], np.zeros(0))
    assert remaining.size == 0
    assert all(one is other for one, other in zip(found, strokes))
