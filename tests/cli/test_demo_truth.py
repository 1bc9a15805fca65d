"""`livebode demo` finds by its baseline what it did to the belt, and reports it everywhere in the same sentence."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Event, UsageError
from livebode.estimation import Tracker
from livebode.monitoring import Baseline, Monitor
from livebode.records import RunRecord
from livebode.runtime import Destination, Document
from livebode.runtime.demo import LOSS, check_seconds, demo, demo_axis, demo_baseline, demo_settings
from livebode.simulation import SimulatedAxis
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.reports import Page

_WINDOW_S = 0.2


@cache
def baseline() -> Baseline:
    return demo_baseline(2)


def test_the_alarm_is_the_same_sentence_in_terminal_page_record_and_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("livebode.runtime.demo.demo_baseline", lambda seed: {2: baseline}[seed]())  # learned once
    done = livebode("demo", "--fast", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    (change,) = [
        event
        for line in (tmp_path / "run" / "events.jsonl").read_text("utf-8").splitlines()
        if (event := json.loads(line))["kind"] == "change"
    ]
    assert (change["details"]["what"], change["details"]["place_m"]) == ("stiffness", None)
    assert change["details"]["since_s"] == pytest.approx(11.0, abs=2 * _WINDOW_S)
    assert abs(change["details"]["amount_percent"] + 100 * LOSS) < 2 * change["details"]["bound_percent"]
    monitoring = json.loads((tmp_path / "run" / "run.json").read_text("utf-8"))["monitoring"]
    assert done.out.splitlines()[-2:] == [change["message"], monitoring["message"]]
    assert livebode("report", tmp_path / "run", "--out", tmp_path / "report").code == 0
    page = Page((tmp_path / "report.html").read_text("utf-8"))
    assert re.search(f"ALARM {re.escape(change['message'])}", page.text)
    published: list[Document] = []
    to = Destination(tmp_path / "again", lambda *_: None, subscribers=(published.append,))
    demo(to, seconds=22, seed=1, real_time=False, baseline=baseline())
    assert change["message"] in [document.message for document in published if isinstance(document, Event)]
    first, again = (RunRecord.open(tmp_path / name).responses() for name in ("run", "again"))
    assert np.array_equal(first.value, again.value, equal_nan=True)


def test_a_healthy_axis_raises_no_alarm() -> None:
    settings = demo_settings()
    monitor, tracker = Monitor(baseline(), settings), Tracker(settings)
    events = [e for b in SimulatedAxis(demo_axis(24.0, 9)).blocks() for e in monitor.process(b, tracker.process(b))]
    assert [event.message for event in events + monitor.finish()] == []


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
