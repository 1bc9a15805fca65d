"""Coverage, power and false discoveries of trends: short form of `python -m studies.archive_trends`."""

from __future__ import annotations

import pytest

from livebode_plant.trending.machine_year import MachineYear
from studies.archive_trends import Tally, false_share

MACHINES = 120


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_a_tenth_of_a_percent_a_month_is_found_and_the_bound_covers(correlation: float) -> None:
    """200 runs over a year, 0.3 % scatter, ±1 % by temperature, 3 % outliers of up to 5 %."""
    of = Tally.of(MachineYear(per_month=-0.1, correlation=correlation), range(MACHINES))
    print(of)
    # A bound that covers 95 % covers fewer than 90 % of 120 in one case of 100.
    assert of.covered >= 0.9
    assert of.change_covered >= 0.9
    assert of.found >= 0.97
    assert of.bound < 0.04


def test_a_healthy_machine_has_no_trend_and_no_change() -> None:
    of = Tally.of(MachineYear(correlation=0.3), range(1000, 1000 + MACHINES))
    assert of.covered >= 0.9
    assert of.found <= 0.03  # more than three of 120 below 1 % are by chance in one case of 30
    assert of.named >= 0.97


@pytest.mark.parametrize(
    "year", [MachineYear(jump=-1.0, correlation=0.3), MachineYear(bend=-0.8)], ids=["jump", "bend"]
)
def test_a_change_is_named_and_dated_and_the_slope_after_it_is_covered(year: MachineYear) -> None:
    of = Tally.of(year, range(25))
    assert of.named >= 0.88
    assert of.covered >= 0.8
    assert of.found >= 0.95


def test_false_discoveries_of_a_fleet_are_at_most_five_percent() -> None:
    # Fewer runs than in the study: one fleet of 210 instead of twenty of 1,050.
    share, power = false_share(3, 200, 10, MachineYear(runs=60, correlation=0.3), per_month=-0.3)
    assert share <= 0.17  # two false ones beside ten; expected is half a machine
    assert power == 1.0
