"""Changes without a model: lines and parameters in bins of a schedule, against a truth made of numbers."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import BaselineError
from livebode.monitoring import DEFAULT_INTERVAL_S, TableMonitor, WindowRows, learn_table
from livebode.monitoring.charts import Charts, threshold
from tests.support.errors import refused

NAMES = ("20 Hz", "60 Hz", "100 Hz")
TRUE = np.array([1.4 + 0.2j, 4.0 - 1.0j, 0.5 - 1.1j])
SIGMA = 0.02


def made(
    windows: int, seed: int, *, factor: np.ndarray | float = 1.0, louder: float = 1.0, real: bool = False
) -> WindowRows:
    """Back and forth between 0 and 1 in 50 windows; the mean depends on the place and on the way."""
    generator = np.random.default_rng(seed)
    at = np.arange(windows)
    schedule = 0.5 - 0.5 * np.cos(2 * np.pi * at / 100)
    step = np.diff(schedule, prepend=np.nan)
    place = 1 + 0.5 * schedule + 0.02 * np.sign(np.nan_to_num(step))
    mean = (np.abs(TRUE) if real else TRUE) * place[:, np.newaxis] * factor
    noise = generator.standard_normal((2, windows, 3))
    scatter = SIGMA * louder * np.abs(TRUE) * (noise[0] if real else (noise[0] + 1j * noise[1]) / np.sqrt(2))
    variance = np.ones((windows, 3)) * (SIGMA * louder * np.abs(TRUE)) ** 2
    ok = np.isfinite(step)
    return WindowRows(mean + scatter, variance, schedule, step, 0.1 * at, 400 * at + 399, ok)


def monitor(what: str = "lines", interval_s: float = DEFAULT_INTERVAL_S) -> TableMonitor:
    table = learn_table(what, NAMES, [made(6000, 1, real=what == "parameters")])
    return TableMonitor(table, interval_s, 0.1)


def test_the_learned_table_has_the_mean_and_variance_of_the_data() -> None:
    table = learn_table("lines", NAMES, [made(6000, 1)])
    cell, known = table.place(made(6000, 2))
    assert known[1:].mean() > 0.99
    deviation, variance = table.deviation(made(6000, 2), cell)
    seen = np.isfinite(variance) & known[:, np.newaxis]
    assert np.mean((deviation**2 / variance)[seen]) == pytest.approx(1.0, abs=0.05)
    assert table.accuracy.inflation.max() < 1.2


def test_healthy_rows_raise_no_alarm() -> None:
    watcher = monitor()
    assert watcher.process(made(20000, 3)) == []
    assert watcher.judged > 19000


@pytest.mark.parametrize("what", ["lines", "parameters"])
def test_the_line_that_changed_is_named(what: str) -> None:
    factor = np.ones((3000, 3))
    factor[1000:2000, 1] = 0.96
    watcher = monitor(what)
    events = watcher.process(made(3000, 4, factor=factor, real=what == "parameters"))
    assert [e.kind for e in events] == ["change", "change-cleared"]
    changes = events[0].details["changes"]
    assert [c["name"] for c in changes] == ["60 Hz"]
    assert abs(changes[0]["amount"] + 4.0) < 2 * changes[0]["bound"]
    assert abs(events[0].details["since_s"] - 100.0) < 2.0
    assert 200.0 < events[1].time_s < 260.0  # five passes of the place where it was seen
    assert not watcher.standing


def stepped(seed: int) -> WindowRows:
    """A change of −26 % at row 100, which the rows behind it take for noise: their variance says 400 times as much."""
    factor = np.ones((200, 3))
    factor[100:, 1] = 0.74
    rows = made(200, seed, factor=factor)
    variance = rows.variance.copy()
    variance[100:130] *= 400.0
    return WindowRows(**(vars(rows) | {"variance": variance}))


def test_an_amount_is_right_while_the_step_is_in_the_rows_own_scatter() -> None:
    """Thirty steps: 95 % of the bounds cover the truth (24 of 30 is 4 sigma below), dates are right to two windows.

    So do 95 % of the intervals of the dates.
    """
    table, covered, dated = learn_table("lines", NAMES, [made(6000, 1)]), 0, 0
    for seed in range(30):
        watcher = TableMonitor(table, DEFAULT_INTERVAL_S, 0.1)
        event = next(e for e in watcher.process(stepped(100 + seed)) if e.kind == "change")
        change = next(c for c in event.details["changes"] if c["name"] == "60 Hz" and c["of"] == "magnitude")
        covered += abs(change["amount"] + 26.0) <= change["bound"]
        assert abs(event.details["since_s"] - 10.0) <= 0.2
        dated += event.details["since_earliest_s"] <= 10.0 <= event.details["since_latest_s"]
        assert event.time_s < 13.0
    assert covered >= 24
    assert dated >= 24


def test_a_large_change_is_reported_in_magnitude_and_phase() -> None:
    factor = np.ones((300, 3), dtype=complex)
    factor[100:, 0] = 1.5 * np.exp(0.7j)
    events = monitor().process(made(300, 40, factor=factor))
    amounts = {c["of"]: c for c in events[0].details["changes"] if c["name"] == "20 Hz"}
    assert amounts["magnitude"]["amount"] == pytest.approx(50.0, abs=2 * amounts["magnitude"]["bound"])
    assert amounts["phase"]["amount"] == pytest.approx(np.degrees(0.7), abs=2 * amounts["phase"]["bound"])


def test_louder_noise_is_no_change() -> None:
    assert monitor().process(made(5000, 5, louder=4.0)) == []


def test_a_position_that_was_not_learned_is_reported_once() -> None:
    rows = made(600, 6)
    beyond = WindowRows(**(vars(rows) | {"schedule": rows.schedule + 0.7}))
    watcher = monitor()
    events = watcher.process(beyond)
    assert [e.kind for e in events if e.kind != "change"] == ["baseline-unknown"]


def test_windows_that_hang_together_are_allowed_for() -> None:
    """Noise that lasts for five windows: as many alarms as asked for at most, and none of them for a month."""

    def slow(seed: int) -> WindowRows:
        rows = made(6000, seed)
        steady = rows.value - made(6000, seed, louder=0.0).value
        smoothed = np.stack([np.convolve(steady[:, i], np.ones(5) / np.sqrt(5), "same") for i in range(3)], axis=1)
        return WindowRows(**(vars(rows) | {"value": rows.value - steady + smoothed}))

    table = learn_table("lines", NAMES, [slow(7)])
    assert table.accuracy.inflation.min() > 2.0
    assert TableMonitor(table, DEFAULT_INTERVAL_S, 0.1).process(slow(8)) == []


def test_the_error_of_a_short_baseline_raises_no_alarm() -> None:
    """Thirty baselines from forty windows of one place, each judged for 1,500: no alarm.

    One alarm in 30 days is asked for, and 75 minutes are judged. A mean that is off by up to three of its standard
    deviations keeps to that; one of the 180 components is off by more in four of ten such tests, and only from four and
    a half on (once in 800 such tests) would its sum rise.
    """

    def still(windows: int, seed: int) -> WindowRows:
        rows, place = made(windows, seed, louder=5.0), made(windows, seed, louder=0.0)
        nowhere = np.full(windows, np.nan)
        value = rows.value / place.value
        return WindowRows(
            **(vars(rows) | {"value": value, "schedule": nowhere, "step": nowhere, "ok": np.ones(windows) > 0})
        )

    for seed in range(30):
        watcher = TableMonitor(learn_table("lines", NAMES, [still(40, 1000 + seed)]), DEFAULT_INTERVAL_S, 0.1)
        assert watcher.process(still(1500, 2000 + seed)) == []
        assert watcher.judged == 1500


def test_mean_time_between_false_alarms_of_a_chart() -> None:
    """At least as long as asked for (Lorden's bound), for small and for large changes a step, over 400 waits each."""
    generator = np.random.default_rng(9)
    for size in (0.5, 1.0, 3.0):
        asked, waits = 200, 400
        charts = Charts(np.full(waits, size), np.zeros(waits), threshold(asked * 0.1, 0.1, 2))
        first = np.zeros(waits)
        for step in range(1, 20 * asked):
            charts.step(generator.standard_normal(waits), np.ones(waits), step)
            up = charts.raised.any(axis=0) & (first == 0)
            first[up] = step
            if np.all(first):
                break
        first[first == 0] = 20 * asked
        assert first.mean() > asked * (1 - 3 / np.sqrt(waits))


def test_a_change_is_found_as_soon_as_information_allows() -> None:
    """Lorden: h over the information of a step, and some overshoot."""
    charts, steps = Charts(np.array([1.0]), np.zeros(1), threshold(2592000, 0.1, 2)), 0
    generator = np.random.default_rng(10)
    while not charts.raised.any():
        charts.step(generator.standard_normal(1) + 1.0, np.ones(1), steps)
        steps += 1
    assert steps < 2 * charts.threshold / 0.5


def test_too_few_windows_to_learn_are_refused() -> None:
    with refused(BaselineError, "too-few-windows", quantity="lines"):
        learn_table("lines", NAMES, [made(20, 11)])
    with refused(BaselineError, "too-few-windows", windows=0):
        learn_table("lines", NAMES, [])
