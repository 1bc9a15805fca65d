"""What the terminal prints covers the truth: the values of `livebode fit`, as a person reads them, over many runs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from livebode.analysis import averaged
from livebode.core import COVERAGE
from livebode.records import RunRecord
from tests.support.command import livebode
from tests.support.servo import Servo, write_axis

_RUNS = 40


def test_printed_bounds_and_those_of_the_lines_cover_the_truth_as_often_as_they_state(tmp_path: Path) -> None:
    servo, covered = (
        Servo(),
        dict.fromkeys(("motor inertia Js", "belt stiffness Keff", "resonance", "antiresonance"), 0),
    )
    within = list[NDArray[np.bool_]]()
    truth = dict(zip(covered, (servo.motor, servo.stiffness, servo.resonance_hz, servo.antiresonance_hz)))
    for seed in range(_RUNS):
        write_axis(tmp_path, "axis", servo, seed)
        done = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run", "--force")
        assert done.code == 0, done.err
        mean = averaged(RunRecord.open(tmp_path / "run")).response
        within.append(np.abs(mean.value - servo.response(mean.frequency_hz)) <= mean.bound())
        printed = livebode("fit", tmp_path / "run").out
        assert "± covers 95 %" in printed
        for words, true in truth.items():
            value, half = re.search(rf"^  {words} +(\S+) ± (\S+)", printed, re.M).groups()  # type: ignore[union-attr]
            covered[words] += abs(float(value) - true) <= float(half)
    lines = np.array(within)
    print(f"of {_RUNS} runs the printed bounds cover the truth in: {covered}; of lines in {lines.mean():.3f}")
    low, high = np.array(binom.interval(0.999, lines.size, COVERAGE)) / lines.size
    assert low <= lines.mean() <= high
    low, high = binom.interval(0.999, _RUNS, COVERAGE)
    for words, count in covered.items():
        assert low <= count <= high, (words, count, low, high)
