"""Cost of the detection of repeating errors in a Tracker, per period of the excitation.

`python -m bench.repeating` tracks the same samples with and without it, side by side, and prints the difference.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from livebode.core import Block, Channel, Lines
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine, odd_lines

RATE_HZ, PERIODS, TURNS = 4000.0, 100, 8
CHANNELS = (Channel("w"), Channel("u"), Channel("y", "rad"))
LINES = (
    Lines.of_bins([1, 3, 5, 7], 80, RATE_HZ),
    Lines.parse("20:140:20", RATE_HZ, 400),
    odd_lines(20, 140, RATE_HZ, 800, seed=1),
    odd_lines(20, 140, RATE_HZ, 1600, seed=1),
)


def _tracking(lines: Lines, repeating: bool) -> Callable[[], object]:
    w = np.tile(multisine(lines), PERIODS)
    y = w + 0.1 * np.random.default_rng(0).standard_normal(w.size)
    settings = Settings(lines=lines, output="y", input="u", excitation="w", hop=lines.window)
    block = Block(np.array([w, w, y]), CHANNELS, RATE_HZ)
    return lambda: Tracker(settings, repeating=repeating).process(block)


def _processor_s(work: Callable[[], object]) -> float:
    began = time.thread_time()
    work()
    return time.thread_time() - began


def main() -> None:
    for lines in LINES:
        both = _tracking(lines, True), _tracking(lines, False)
        taken = [min(turn) for turn in zip(*[[_processor_s(work) for work in both] for _ in range(TURNS)])]
        cost = (taken[0] - taken[1]) / PERIODS
        share = cost * lines.rate_hz / lines.window
        print(f"N = {lines.window}, {len(lines)} lines: {cost * 1e6:.0f} µs per period, {share:.2%} of a core")


if __name__ == "__main__":
    main()
