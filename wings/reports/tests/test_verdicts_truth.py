"""Verdicts name what the record contains: an active alarm is ALARM, and no difference is shown with its sensitivity."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import Event, date_and_time
from livebode.fitting import fit, mean_response
from livebode_reports.compare_report import Comparison
from livebode_reports.difference import Difference
from livebode_reports.html import to_html
from livebode_reports.parameter_track import Track
from livebode_reports.report_data import read
from livebode_reports.run_report import report_of, run_report
from tests.support.reports import measured, write_run

MADE = datetime(2026, 11, 21, 12, tzinfo=UTC)
SOFTER = "Since 12.2 s the belt's stiffness is 2.01 ± 0.02 % less than in the baseline."


def monitored(path: Path, seed: int, changes: int, active: int) -> Path:
    """A healthy-looking run whose monitoring reported so many changes, of which some are still active."""
    change = {"what": "stiffness", "amount_percent": -2.01, "bound_percent": 0.02}
    monitoring: dict[str, Any] = {
        "baseline": "healthy.json", "false_alarm_interval_days": 365.25, "judged_by": "model", "judged_s": 24.9,
        "changes": changes, "cleared": changes - active, "standing": [change] * active,
        "message": f"{changes} changes against the baseline" if changes else "No change against the baseline.",
    }  # fmt: skip
    events = [Event("change", 48_800, 12.2, SOFTER, change)] * changes
    return write_run(path, measured(300, seed), events=events, monitoring=monitoring)


@pytest.mark.parametrize(
    ("changes", "active", "verdict"), [(1, 1, "ALARM"), (1, 0, "check"), (0, 0, "OK")], ids=str
)  # fmt: skip
def test_a_report_heads_the_run_by_its_alarms(tmp_path: Path, changes: int, active: int, verdict: str) -> None:
    document = run_report(monitored(tmp_path / "run", 1, changes, active), made=MADE)
    found = {finding.text: document.tones[finding.tone] for finding in document.verdict}
    assert found[f"{changes} changes against the baseline" if changes else "No change against the baseline."] == verdict
    assert found.get(SOFTER) == ("ALARM" if active else None)
    if active:
        assert document.tones[document.verdict[0].tone] == "ALARM"
        assert '<span class="tone alarm">ALARM</span>' in to_html(document)


def test_a_run_without_a_baseline_is_not_assessed(tmp_path: Path) -> None:
    document = run_report(write_run(tmp_path / "run", measured(300, 1)), made=MADE)
    (changes,) = [f for f in document.verdict if "baseline" in f.text]
    assert document.tones[changes.tone] == "not assessed"


@pytest.mark.parametrize(("rows", "gaps", "found"), [((0,), 0, 0), ((0, 7), 0, 1), ((0, 7), 1, 0)], ids=str)
def test_invalid_windows_of_a_start_and_a_gap_are_no_finding(tmp_path: Path, rows: Any, gaps: int, found: int) -> None:
    """Windows overlap by half, so that each start makes one of ten responses invalid; the appendix counts them."""
    responses = measured(10, 1)
    responses.valid[list(rows)] = False
    document = run_report(write_run(tmp_path / "run", responses, counts={"gaps": gaps}), made=MADE)
    findings = [f for f in document.verdict if "an invalid line" in f.text]
    assert [(f.tone, f.subject) for f in findings] == [("check", "measurement")] * found
    (quality,) = [section for section in document.appendix if section.title == "Data quality"]
    assert f"{len(rows)} ({10 * len(rows)} %)" in str(quality.parts)


@pytest.mark.parametrize(
    ("rejected", "finding"),
    [
        ({"no response": 19, "not seen": 8}, None),  # windows at the start, of which nothing can be fitted yet
        ({"no response": 19, "not seen": 40}, "Of 361 fits over the run, 40 were rejected: 40 not seen."),
    ],
    ids=str,
)
def test_what_the_software_left_out_is_in_the_appendix_and_no_verdict(
    tmp_path: Path, rejected: dict[str, int], finding: str | None
) -> None:
    run = read(write_run(tmp_path / "run", measured(30, 1)))
    track = Track(run.of.overview.time_s, model="two-mass")
    track.statuses.update({"ok": 380 - sum(rejected.values())} | rejected)
    document = report_of(replace(run, fit=fit(run.of.response, "two-mass"), tracks={"two-mass": track}), made=MADE)
    assert [f.text for f in document.verdict if "fits over the run" in f.text] == [finding] * (finding is not None)
    verdict, *below = document.result
    assert (verdict.tone, "not judged" in verdict.text) == ("open", True)
    assert finding is None or finding in [f.text for f in below]
    (quality,) = [section for section in document.appendix if section.title == "Data quality"]
    assert f"380 (rejected: 19 no response, {rejected['not seen']} not seen)" in str(quality.parts)


def test_a_comparison_is_headed_by_the_alarm_of_a_run_though_no_line_differs(tmp_path: Path) -> None:
    before, after = monitored(tmp_path / "a", 1, 0, 0), monitored(tmp_path / "b", 2, 1, 1)
    document = Comparison.of(before, after).document(MADE)
    first, *rest = document.verdict
    assert (document.tones[first.tone], first.text) == ("ALARM", "After: 1 changes against the baseline")
    assert f"After: {SOFTER}" in [f.text for f in rest if f.tone == "alarm"]
    (lines,) = [f for f in rest if f.text.startswith("No line differs")]
    assert document.tones[lines.tone] == "no difference shown"
    assert "detectable: ≥ " in lines.text


def test_only_changes_that_have_not_cleared_are_alarms_each_by_its_newest_amount(tmp_path: Path) -> None:
    def change(kind: str, what: str, message: str) -> Event:
        return Event(kind, 1, 1.0, message, {"what": what, "place_m": None})

    monitoring = {"baseline": "healthy.json", "judged_s": 9.0, "changes": 2, "standing": [{}], "message": "1 active"}
    events = [
        change("change", "stiffness", "soft"), change("change", "damping", "rough amount"),
        change("change-cleared", "stiffness", "gone"), change("change-corrected", "damping", "right amount"),
    ]  # fmt: skip
    run = write_run(tmp_path / "run", measured(300, 1), events=events, monitoring=monitoring)
    alarms = [finding.text for finding in run_report(run, made=MADE).verdict if finding.tone == "alarm"]
    assert alarms == ["1 active", "right amount"]


def test_a_change_of_the_size_that_would_have_been_seen_is_seen_in_95_percent() -> None:
    """1,400 lines, each changed by its own `seen`: 95 % found, within four deviations of the count."""
    pairs, found, lines = 200, 0, 0
    for i in range(pairs):
        before, after = (mean_response(measured(60, 2 * i + j))[0] for j in (0, 1))
        seen = Difference.of(before, after).seen
        changed = Difference.of(before, replace(after, value=after.value + seen * before.value))
        found, lines = found + int(changed.differs.sum()), lines + len(seen)
    assert abs(found / lines - 0.95) < 4 * np.sqrt(0.95 * 0.05 / lines) + 0.01  # sigma is itself estimated


@pytest.fixture
def zone() -> Iterator[None]:
    """Central European time."""
    before = os.environ.get("TZ")
    os.environ["TZ"] = "Europe/Berlin"
    time.tzset()
    yield
    if before is None:
        del os.environ["TZ"]
    else:
        os.environ["TZ"] = before
    time.tzset()


@pytest.mark.usefixtures("zone")
def test_a_moment_since_1970_is_the_local_time_of_day_with_its_zone() -> None:
    for local, zone in (("2026-07-01 14:32:07", "CEST"), ("2026-12-01 14:32:07", "CET")):
        stamp = time.mktime(time.strptime(local, "%Y-%m-%d %H:%M:%S"))
        assert date_and_time(stamp) == f"{local} {zone}"
    autumn = datetime(2026, 10, 25, 0, 30, tzinfo=UTC).timestamp()  # 02:30 comes twice that night
    assert [date_and_time(autumn), date_and_time(autumn + 3600)] == [
        "2026-10-25 02:30:00 CEST",
        "2026-10-25 02:30:00 CET",
    ]
