"""The study of bounds of a live average of a machine that changes, in small."""

from __future__ import annotations

import numpy as np
import pytest

from studies.variation_live import COURSES, alarms_at_rest, main, measured


@pytest.mark.parametrize("name", ["rest", "linear, 40 % in 20 s", "settling, 30 % in 4 s"])
def test_the_bounds_of_an_average_cover_a_changing_machine(name: str) -> None:
    """Two runs of 20 s have about 13 lines · 17 independent averages: 63 % ± 6 % and 98 % ± 2 % (two sigma)."""
    found = measured(COURSES[name], 2, 0)
    one, two = found.shares(found.sigma)
    assert 0.57 <= one <= 0.72
    assert two >= 0.96
    assert max(found.widths()[:1]) <= 1.5
    assert bool(found.reported_s) == (name != "rest")


def test_noise_and_variation_of_an_even_change_are_those_of_the_truth() -> None:
    """The part of variation is 10 % above the standard deviation, so that 63.2 % of an even change are within it."""
    found = measured(COURSES["linear, 40 % in 20 s"], 2, 10)
    ratio = np.sqrt(np.mean(found.variation**2) / np.mean(found.spread**2))
    assert ratio == pytest.approx(1.1, abs=0.15)


def test_the_tables_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert alarms_at_rest(1, 0, minutes=1.0) == 0
    main(["--runs", "1", "--rest", "1"])
    assert "| step, 10 % at 10 s |" in capsys.readouterr().out
