"""Processes that record are killed with signal 9 at random moments; `make crash` kills many more."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from tests.support.killed import kill_often, run_s

KILLS = int(os.environ.get("LIVEBODE_CRASH_KILLS", "12"))


def test_a_kill_loses_at_most_the_last_second_and_the_run_continues(tmp_path: Path) -> None:
    run_s(tmp_path / "first")  # with what a first process imports
    whole_s = run_s(tmp_path / "alone")
    rng, kills, runs = np.random.default_rng(16), 0, 0
    while kills < KILLS:
        runs += 1
        assert runs <= 50 + 10 * KILLS
        kills += kill_often(tmp_path / str(runs), whole_s, rng)
    print(f"{kills} kills in {runs} runs; every record was whole up to its last second, and went on to the same end")
