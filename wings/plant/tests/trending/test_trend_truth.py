"""Trends of simulated machines against the truth: coverage, power and false discoveries, with seeds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode_plant.trending import MONTH_S, NotAssessed, Ranked, Trend, discoveries, months_to_limit, trend_of, urgency
from livebode_plant.trending.machine_year import LEVEL, START_S, MachineYear


def trend(year: MachineYear, seed: int = 1, **replaced: object) -> Trend:
    time_s, value, bound, covariates = year.measured(seed)
    given = {"time_s": time_s, "value": value, "bound_95": bound, "covariates": covariates} | replaced
    found = trend_of(**given)  # type: ignore[arg-type]
    assert isinstance(found, Trend)
    return found


def test_the_temperature_explains_what_would_be_a_trend() -> None:
    """Half a year from winter to summer; without its temperature the machine seems to change."""
    year = MachineYear(months=6.0, per_kelvin=0.2, runs=120)
    with_it, without = trend(year, 4), trend(year, 4, covariates={})
    assert abs(with_it.per_month) <= with_it.per_month_bound_95
    assert with_it.p > 0.05 > without.p
    (effect,) = with_it.effects
    assert abs(effect.per_unit - 0.2) <= effect.bound_95


def test_a_season_is_part_of_the_regression_from_a_year_and_a_half() -> None:
    year = MachineYear(months=30.0, runs=400, per_month=-0.1)
    found = trend(year, 5, covariates={})
    assert abs(found.per_month + 0.1) <= found.per_month_bound_95 < 0.02
    assert not found.changes


def test_a_covariate_that_goes_with_the_time_is_reported_and_widens_the_bound() -> None:
    year = MachineYear(per_kelvin=0.0)
    time_s = year.measured(6)[0]
    rising = {"temperature": 20 + (time_s - START_S) / MONTH_S + np.random.default_rng(6).normal(0, 0.2, len(time_s))}
    found, free = trend(year, 6, covariates=rising), trend(year, 6, covariates={})
    assert found.per_month_bound_95 > 5 * free.per_month_bound_95
    assert found.remarks == ("temperature changes with the time, so the bound of the trend is wide",)


def test_a_failed_sensor_does_not_move_the_trend() -> None:
    year = MachineYear(per_month=-0.1)
    covariates = year.measured(7)[3]
    broken = covariates["temperature"].copy()
    broken[::20] = -9999.0
    found = trend(year, 7, covariates={"temperature": broken, "dead": np.full(200, 20.0)})
    assert found.left_out == 10
    assert abs(found.per_month + 0.1) <= found.per_month_bound_95 < 0.03
    assert found.remarks == ("dead is constant and was not used",)


@pytest.mark.parametrize(
    ("runs", "months", "words"),
    [(0, 12.0, "0 runs"), (19, 12.0, "19 runs"), (60, 0.5, "days")],
)
def test_too_few_runs_and_too_short_a_time_are_not_assessed(runs: int, months: float, words: str) -> None:
    year = MachineYear(runs=max(runs, 1), months=months)
    time_s, value, bound, covariates = (part if isinstance(part, dict) else part[:runs] for part in year.measured(8))
    found = trend_of(time_s, value, bound, {"temperature": covariates["temperature"][:runs]})  # type: ignore[index,arg-type,call-overload]
    assert isinstance(found, NotAssessed)
    assert words in found.reason


def test_axes_of_one_machine_share_a_trend_but_not_a_level() -> None:
    year = MachineYear(per_month=-0.3)
    value = year.measured(9)[1]
    member = np.arange(len(value)) % 2
    value = np.where(member == 1, value + 40, value)
    found = trend(year, 9, value=value, member=member)
    assert abs(found.per_month + 0.3) <= found.per_month_bound_95 < 0.05


def test_the_order_of_the_rows_does_not_matter() -> None:
    year = MachineYear(jump=-2.0)
    time_s, value, bound, covariates = year.measured(10)
    shuffled = np.random.default_rng(0).permutation(len(value))
    one = trend(year, 10)
    other = trend(
        year, 10, time_s=time_s[shuffled], value=value[shuffled], bound_95=bound[shuffled],
        covariates={name: x[shuffled] for name, x in covariates.items()},
    )  # fmt: skip
    assert other.per_month == one.per_month
    assert other.changes == one.changes


@settings(max_examples=6, deadline=None)
@given(scale=st.floats(1e-3, 1e9), seed=st.integers(0, 20))
def test_the_unit_does_not_matter(scale: float, seed: int) -> None:
    year = MachineYear(runs=60, jump=-2.0)
    _, value, bound, _ = year.measured(seed)
    one, other = trend(year, seed), trend(year, seed, value=scale * value, bound_95=scale * bound)
    assert [c.kind for c in other.changes] == [c.kind for c in one.changes]
    assert other.per_month == pytest.approx(scale * one.per_month, rel=1e-3, abs=1e-4 * scale)
    assert other.p == pytest.approx(one.p, rel=1e-2)


def test_the_ranking_has_the_machine_that_reaches_its_limit_first_at_the_top() -> None:
    machines = {
        "healthy": MachineYear(),
        "slow": MachineYear(per_month=-0.2),
        "fast": MachineYear(per_month=-0.5),
        "jumped": MachineYear(jump=-12.0),
        "jumped a little": MachineYear(jump=-2.0),
    }
    trends = {name: trend(year, seed) for seed, (name, year) in enumerate(machines.items())}
    found = zip(trends.items(), discoveries([one.p for one in trends.values()]))
    ranked = sorted((Ranked(*item, own, months_to_limit(item[1], 10.0)) for item, own in found), key=urgency)
    assert [one.machine for one in ranked] == ["jumped", "fast", "slow", "jumped a little", "healthy"]
    assert [one.significant for one in ranked] == [True] * 4 + [False]
    months = {one.machine: one.months for one in ranked}
    assert months["jumped"] == 0
    # 10 % of the level at 0.5 % a month, of which a year is over.
    assert months["fast"] == pytest.approx(LEVEL / 10 / 0.5 - 12, abs=1.5)
    assert np.isinf(months["jumped a little"])


def test_no_machine_is_no_discovery() -> None:
    assert discoveries([]) == []
    assert discoveries([1.0, 1.0]) == [False, False]
