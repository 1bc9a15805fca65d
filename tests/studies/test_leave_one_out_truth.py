"""Bounds of real recordings contain a period left out: short form of `python -m studies.leave_one_out`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode import Block, Lines, Settings
from studies.leave_one_out import Bench, benches, measure
from tests.support.real_recordings import recording


def test_noise_of_a_steady_machine_is_covered_as_promised() -> None:
    """A gain of 2 with white noise, 12 periods of 20 lines: 240 values, of which three standard deviations are 9 %."""
    rng, lines = np.random.default_rng(3), Lines.parse("10:200:10", rate_hz=1000, window=200)
    w = np.tile(rng.standard_normal(200), 12)
    block = Block(np.array([w, 2 * w + 0.1 * rng.standard_normal(w.size)]), ["u", "y"], 1000.0)
    settings = Settings(lines=lines, excitation="u", input="u", output="y", hop=200)
    bench = Bench("simulated", "", lambda _: block, range(12), settings)
    (low, high), _, values = measure(bench, block, average=True)
    assert values == 12 * (len(lines))
    assert 54 < low < 78
    assert high > 90


def test_a_recording_gives_shares_of_all_its_values() -> None:
    bench = replace(benches()[1], periods=range(2, 8))
    (low, high), width, values = measure(bench, bench.read(recording(bench.file)), average=True)
    assert values == 6 * len(bench.settings.lines)
    assert 0 < low <= high <= 100
    assert width > 0
