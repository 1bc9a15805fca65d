"""`livebode demo` finds by its baseline what it did to the belt, and reports it everywhere in the same sentence."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

from livebode.analysis import Overview
from livebode.core import UsageError
from livebode.dashboard import Hub
from livebode.dashboard.board import verdict
from livebode.dashboard.state import State
from livebode.estimation import Tracker
from livebode.monitoring import Monitor
from livebode.records import RunRecord
from livebode.runtime import ChangeDetection, RunControl, RunStarted, check_seconds
from livebode.runtime._demo import LOSS, demo_axis, demo_settings
from livebode.simulation import SimulatedAxis
from tests.support.command import livebode
from tests.support.demonstrated import learned, shown
from tests.support.errors import refused
from tests.support.reports import Page
from tests.support.runs import record

_WINDOW_S = 0.2


def test_the_alarm_is_the_same_sentence_in_terminal_page_record_and_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the page of the dashboard too: tests/dashboard/test_commands_truth.py."""
    demonstrated, printed = shown()
    (change,) = [event for event in RunRecord.open(demonstrated).events() if event.kind == "change"]
    assert (change.details["what"], change.details["place_m"]) == ("stiffness", None)
    assert change.details["since_s"] == pytest.approx(11.0, abs=2 * _WINDOW_S)
    assert abs(change.details["amount_percent"] + 100 * LOSS) < 2 * change.details["bound_percent"]
    monitoring = json.loads((demonstrated / "run.json").read_text("utf-8"))["monitoring"]
    lines = printed.splitlines()
    assert lines[lines.index(change.message) + 1] == monitoring["message"]
    monkeypatch.setitem(sys.modules, "reportlab", None)  # the page alone
    assert livebode("report", demonstrated, "--out", tmp_path / "report").code == 0
    page = Page((tmp_path / "report.html").read_text("utf-8"))
    assert re.search(f"ALARM {re.escape(change.message)}", page.text)


def test_a_healthy_axis_raises_no_alarm() -> None:
    settings = demo_settings()
    monitor, tracker = Monitor(learned(), settings), Tracker(settings)
    events = [e for b in SimulatedAxis(demo_axis(24.0, 9)).blocks() for e in monitor.process(b, tracker.process(b))]
    assert [event.message for event in events + monitor.finish()] == []


def test_the_page_of_a_healthy_axis_names_its_baseline_from_the_start(tmp_path: Path) -> None:
    settings, heard = demo_settings(), Hub("axis")
    detection = ChangeDetection(Monitor(learned(), settings), "healthy strokes")
    axis = SimulatedAxis(demo_axis(1.0, 9))
    record(axis, Tracker(settings), tmp_path / "run", subscribers=[heard], detection=detection)
    hub = Hub("axis")  # of the same run, before its end
    state = State("axis", 0, hub)
    hub(RunStarted(tmp_path, dict(heard.begun or {}), RunControl(), Overview()))
    state.refresh()
    assert (state.has_baseline, verdict(state).word) == (True, "healthy")


def test_the_lines_leave_bins_for_the_noise_and_none_is_at_the_mains() -> None:
    lines = demo_settings().lines
    assert len(lines) >= 21
    assert len(lines.quiet) >= 20
    assert not {50.0, 60.0, 100.0, 120.0, 150.0, 180.0} & set(lines.frequency_hz.tolist())


@pytest.mark.parametrize("seconds", [0, 15.9, -1, float("nan"), 1e9])
def test_runs_too_short_or_too_long_are_refused_before_anything_is_learned(seconds: float) -> None:
    with refused(UsageError, "out-of-range", argument="seconds"):
        check_seconds(seconds)
    assert livebode("demo", "--seconds", seconds).out == ""
