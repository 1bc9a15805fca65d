"""Fits of a live run take no more processor time than their budget, whatever a fit costs."""

from __future__ import annotations

import gc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.runtime.shedding import CREDIT_S_MAX, RELIEF_TO_S, SHARE, FitBudget


class Time:
    """A clock, and the processor time of fits that cost `row_s` each."""

    def __init__(self) -> None:
        self.now_s = self.worked_s = 0.0

    def budget(self) -> FitBudget:
        return FitBudget(lambda: self.now_s, lambda: self.worked_s)

    def fit(self, budget: FitBudget, rows: int, row_s: float, behind_s: float = 0.0) -> int:
        allowed = budget.rows(rows, behind_s)
        with budget.spending(allowed):
            self.worked_s += allowed * row_s
        return allowed


@pytest.fixture(autouse=True)
def no_budgets_of_other_tests() -> None:
    """All budgets of a process share its time, those too that wait for the collector."""
    gc.collect()


@settings(max_examples=25, deadline=None)
@given(st.floats(1e-4, 3.0), st.integers(1, 50), st.integers(1, 3))
def test_the_share_is_held_whatever_a_fit_costs(row_s: float, rows: int, axes: int) -> None:
    times = [Time() for _ in range(axes)]
    budgets = [time.budget() for time in times]
    for budget in budgets:
        budget.rows(0, 0.0)
    step_s, steps = 0.25, 150
    for _ in range(steps):
        for time, budget in zip(times, budgets):
            time.now_s += step_s
            time.fit(budget, rows, row_s)
    earned_s = SHARE * step_s * steps + axes * CREDIT_S_MAX
    # One batch may overrun what is there: its fits cost more than those before it.
    overrun_s = axes * max(row_s, CREDIT_S_MAX * row_s / 0.02)
    assert sum(time.worked_s for time in times) <= earned_s + overrun_s


def test_cheap_fits_are_all_made() -> None:
    time = Time()
    budget = time.budget()
    for _ in range(1000):
        time.now_s += 0.25
        assert time.fit(budget, 50, 0.0002) == 50


def test_no_fit_is_made_while_the_run_is_far_behind() -> None:
    time = Time()
    budget = time.budget()
    for _ in range(100):
        time.now_s += 0.25
        assert time.fit(budget, 5, 0.001, behind_s=RELIEF_TO_S) == 0
    time.now_s += 1.0
    assert time.fit(budget, 5, 0.001) == 5


def test_a_fit_that_costs_more_than_all_credit_is_tried_now_and_then() -> None:
    time = Time()
    budget = time.budget()
    made = 0
    for _ in range(400):
        time.now_s += 0.25
        made += time.fit(budget, 5, 3.0)
    assert 2 <= made <= (100.0 * SHARE + CREDIT_S_MAX) / 3.0 + 5
