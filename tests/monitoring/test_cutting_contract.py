"""However samples are cut, and wherever a run is interrupted, the events are the same."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from livebode.core import BaselineError, Block, UsageError
from livebode.estimation import Settings, Tracker
from livebode.monitoring import Baseline, Monitor, NonOverlappingWindows, learn_table, places, signals_of
from livebode.simulation import TensionLoss
from tests.support.axes import LINES
from tests.support.errors import refused
from tests.support.monitored import changes_of, machine, pieces, recorded

SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", noise="quiet")
FAULT = TensionLoss(start_s=6.0, loss=0.03)


@cache
def baseline(by_model: bool) -> Baseline:
    responses = Tracker(SETTINGS).process(recorded((0.3,) * 12, seed=40))
    at = places(LINES.window, SETTINGS.step)
    rows = [NonOverlappingWindows(LINES.window, place).of_responses(responses) for place in at]
    table = learn_table("lines", [f"{f:g} Hz" for f in LINES.frequency_hz], rows, len(at))
    return Baseline(
        LINES, SETTINGS.step, signals_of(SETTINGS), "joint", "plant", (table,), machine() if by_model else None
    )


def events_of(monitor: Monitor, tracker: Tracker, parts: list[Block]) -> list[tuple[str, int, str]]:
    found = [e for part in parts for e in monitor.process(part, tracker.process(part))]
    return [(e.kind, e.sample, e.message) for e in found]


@pytest.mark.parametrize("by_model", [True, False], ids=["model", "tables"])
def test_events_do_not_depend_on_cuts_or_snapshots(by_model: bool) -> None:
    block, learned = recorded((0.3, 0.3, 0.3), FAULT, seed=41), baseline(by_model)
    whole = events_of(Monitor(learned, SETTINGS), Tracker(SETTINGS), [block])
    assert [kind for kind, _, _ in whole] == ["change"]
    monitor, tracker, cut = Monitor(learned, SETTINGS), Tracker(SETTINGS), []
    for i, part in enumerate(pieces(block, [1, 3999, 40, 7001, 400])):
        cut += events_of(monitor, tracker, [part])
        if i % 3 == 0:
            follower = Monitor(learned, SETTINGS)
            follower.restore(monitor.snapshot())
            monitor = follower
    assert cut == whole
    assert monitor.summary()["changes"] == 1
    assert monitor.summary()["judged_by"] == ("model" if by_model else "tables")


def test_a_gap_costs_its_windows_alone() -> None:
    """A second is missing, and a sample is not finite: nothing is made up from it, and the change is found."""
    block = recorded((0.3, 0.3, 0.3), FAULT, seed=42)
    data = block.data.copy()
    data[1, 9000] = np.nan
    holed = Block(data, block.channels, block.rate_hz)
    parts = [holed.cut(0, 20000), replace(holed.cut(24000, len(block)), gap=True)]
    monitor, tracker = Monitor(baseline(True), SETTINGS), Tracker(SETTINGS)
    found = [e for part in parts for e in monitor.process(part, tracker.process(part))]
    assert changes_of(found) == [("change", "stiffness")]
    assert abs(found[0].details["since_s"] - 6.0) < 1.5


def test_a_baseline_of_other_runs_is_refused() -> None:
    learned = baseline(False)
    for other, setting, own in (
        (replace(SETTINGS, output="y"), "output", "velocity"),
        (replace(SETTINGS, schedule=None), "schedule", "x"),
        (replace(SETTINGS, estimator="direct"), "estimator", "joint"),
    ):
        with refused(BaselineError, "settings-differ", setting=setting, learned=own):
            Monitor(learned, other)


@pytest.mark.parametrize("interval_s", [0.0, -3.0, float("nan"), float("inf")])
def test_an_interval_that_is_not_positive_and_finite_is_refused(interval_s: float) -> None:
    with refused(UsageError, "out-of-range", argument="false_alarm_interval_s"):
        Monitor(baseline(False), SETTINGS, interval_s)


def test_a_run_without_a_judged_window_is_reported() -> None:
    monitor = Monitor(baseline(True), SETTINGS)
    assert monitor.finish() == []
    assert "Nothing of the run could be judged" in monitor.summary()["message"]
