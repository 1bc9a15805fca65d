"""Charts and the rows behind them: the cheap ways give the bits of the plain ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.monitoring.charts import Charts
from livebode.monitoring.table_monitor import NewestRows

evidence = st.floats(-1e3, 1e3)


def plainly(sums: np.ndarray, since: np.ndarray, smallest: np.ndarray, allowed: np.ndarray, h: float,
            score: np.ndarray, information: np.ndarray, mark: int) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """A step by the formula of the class."""
    gain, middle = smallest - allowed, (smallest + allowed) / 2
    ratio = gain * np.stack([score, -score]) - gain * middle * information
    since = np.where((sums == 0) & (ratio > 0), mark, since)
    return np.clip(sums + ratio, 0.0, h), since


@given(
    steps=st.lists(st.tuples(evidence, evidence, evidence, st.floats(0, 1e4)), max_size=30),
    allowed=st.floats(0, 0.01),
    threshold=st.floats(1, 30),
)
def test_a_step_is_the_formula(
    steps: list[tuple[float, float, float, float]], allowed: float, threshold: float
) -> None:
    smallest, least = np.array([0.01, 0.02, 0.05]), np.full(3, allowed)
    charts = Charts(smallest, least, threshold)
    sums, since = charts.sums.copy(), charts.since.copy()
    for mark, (*scores, information) in enumerate(steps):
        score, informations = np.array(scores), information * np.array([1.0, 0.5, 0.0])
        charts.step(score, informations, mark)
        sums, since = plainly(sums, since, smallest, least, threshold, score, informations, mark)
        assert charts.sums.tobytes() == sums.tobytes()
        assert np.array_equal(charts.since, since)
        assert charts.alarmed == charts.raised.any()


@given(steps=st.lists(st.tuples(st.integers(0, 27), evidence, st.floats(0, 1e4)), max_size=40))
def test_a_step_of_one_component_is_a_step_without_evidence_for_the_others(
    steps: list[tuple[int, float, float]],
) -> None:
    smallest, allowed = np.full(28, 0.02), np.full(28, 0.004)
    one, every = Charts(smallest, allowed, 12.0), Charts(smallest, allowed, 12.0)
    for mark, (component, score, information) in enumerate(steps):
        here = np.arange(28) == component
        one.step_one(component, score, information, mark)
        every.step(here * score, here * information, mark)
        assert one.snapshot() == every.snapshot()


@pytest.mark.parametrize("score", [np.nan, np.inf])
def test_a_component_without_a_number_is_refused(score: float) -> None:
    with pytest.raises(ValueError, match="not a number"):
        Charts(np.ones(2), np.zeros(2), 5.0).step_one(1, score, 1.0, 0)


@given(
    actions=st.lists(st.just("clear") | st.just("restore") | st.integers(1, 9), max_size=30), most=st.integers(1, 24)
)
def test_newest_rows_are_the_last_of_all(actions: list[str | int], most: int) -> None:
    rows, expected, number = NewestRows(2, most), np.zeros((0, 2)), 0.0
    for action in actions:
        if action == "clear":
            rows.clear()
            expected = expected[:0]
        elif action == "restore":
            other = NewestRows(2, most)
            other.fill(rows.array)
            rows = other
        else:
            for _ in range(int(action)):
                number += 1
                rows.append((number, -number))
                expected = np.vstack([expected, (number, -number)])[-most:]
        assert np.array_equal(rows.array, expected)
