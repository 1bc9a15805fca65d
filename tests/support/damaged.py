"""Runs in which one bit is flipped, and what every reader must still find in them."""

from __future__ import annotations

import contextlib
import shutil
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from livebode.configuration import FitSection, RecordSection
from livebode.core import DamageWarning, Event, LivebodeError, RecordError, UsageError
from livebode.dashboard.run_feed import RunFeed
from livebode.dashboard.state import State
from livebode.estimation import Tracker
from livebode.records import RunRecord, query
from livebode.runtime import Document, Fits, TrackerResults
from livebode_reports.run_report import run_report
from tests.support.command import livebode
from tests.support.file_damage import damage as damage_file
from tests.support.recorded import SETTINGS, machine
from tests.support.runs import record

SAMPLES, STOPPED = 2600, 1900
TABLES = ("responses", "responses_1s", "responses_1min", "responses_1h", "parameters", "samples")
CONFIGURATION = {"signals": {"output": "y", "input": "u", "excitation": "w"}}
FIT = FitSection(fixed={"resonance_damping": 0.1, "antiresonance_damping": 0.1, "delay": 0.0})
KEPT = RecordSection(samples=True, segment_s=1.0)
_MOST = 10_000_000


class StopError(Exception):
    pass


def record_run(
    directory: Path, *, until: int = 10**9, segments: bool = True, reported: list[Event] | None = None
) -> None:
    """Record the machine up to a sample, or continue to its end."""

    def listen(document: Document) -> None:
        if isinstance(document, TrackerResults) and document.samples > until:
            raise StopError
        if isinstance(document, Event) and document.kind.startswith("record-") and reported is not None:
            reported.append(document)

    record(
        machine(SAMPLES), Tracker(SETTINGS), directory, fits=Fits(FIT), segments=KEPT if segments else None,
        about={"configuration": CONFIGURATION | {"record": KEPT.model_dump()}}, subscribers=[listen],
    )  # fmt: skip


def make_runs(folder: Path) -> dict[str, Path]:
    """One in one piece with several row groups, one in segments, and one that was killed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("livebode.records.segments.segment_writer.GROUP_ROWS", 400)
        record_run(folder / "piece", segments=False)
    record_run(folder / "segments")
    with pytest.raises(StopError):
        record_run(folder / "killed", until=STOPPED)
    return {name: folder / name for name in ("piece", "segments", "killed")}


@dataclass(frozen=True)
class Seen:
    """Rows of each table as texts, events of the run, and what was named."""

    rows: dict[str, list[str]]
    events: list[Event]
    damages: list[Event]


def seen(path: Path) -> Seen:
    """By `Run`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamageWarning)
        run = RunRecord.open(path)
        rows = {}
        for name in TABLES:
            tables = [table.to_pylist() for table in map(pa.table, run.tables(name))]
            rows[name] = [str(row) for table in tables for row in table]
        for part in run.batches():
            assert len(part)
        events = [event for event in run.events() if event.kind != "record-damaged"]
    return Seen(rows, events, run.damages)


def by_query(path: Path) -> dict[str, list[str]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamageWarning)
        found = {}
        for name in TABLES:
            try:
                answer = query(RunRecord.open(path), f"FROM {name}", _MOST)
            except (UsageError, RecordError) as error:
                if error.code != "record.damaged" and "does not exist" not in error.reason:
                    raise
                found[name] = []
                continue
            found[name] = [str(dict(zip(answer.columns, row))) for row in answer.rows]
    return found


def commands(path: Path, out: Path) -> dict[str, Callable[[], Any]]:
    """What else reads a run, by name; each is refused with a sentence or does its work."""

    def command(*arguments: object) -> Callable[[], Any]:
        def run() -> None:
            done = livebode(*arguments)
            assert done.code in (0, 2, 3), done.err
            assert "Traceback" not in done.err
            assert "internal error" not in done.err

        return run

    return {
        "export": command("export", path, "--to", "csv", "--out", out / "a.csv", "--force"),
        "parameters": command("export", path, "--to", "csv", "--parameters", "--out", out / "b.csv", "--force"),
        "fit": command("fit", path),
        "view": lambda: RunFeed(path).fill(State(path.name, 0)),
        "report": lambda: run_report(path, None, made=datetime(2026, 1, 1, tzinfo=UTC)),
    }


def run_commands(path: Path, out: Path) -> None:
    """Every other command."""
    for call in commands(path, out).values():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DamageWarning)
            with contextlib.suppress(LivebodeError):
                call()


def check_damage(whole: Path, folder: Path, rng: np.random.Generator, kind: str) -> str:
    """Damage a copy of a run and let everything read it; the kind of file."""
    other = folder / "damaged"
    shutil.rmtree(other, ignore_errors=True)
    shutil.copytree(whole, other)
    name = damage_file(other, rng, kind)
    # A journal that is cut is that of a run that was killed earlier, and is continued there.
    torn = kind == "cut" and name.startswith("open/")
    before, after = seen(whole), seen(other)
    files = {str(damage.details["file"]) for damage in after.damages}
    assert files <= {name}, (name, after.damages)
    # Each line of the manifest is there twice, and a kill can leave the last one once: nothing is lost then.
    once = kind == "cut" and (whole.name, name) == ("killed", "manifest.jsonl") and after.rows == before.rows
    assert files or torn or once, (name, kind)
    if torn:
        assert all(rows == before.rows[table][: len(rows)] for table, rows in after.rows.items())
    else:
        _check_rows(name, kind, before, after)
    for table, rows in by_query(other).items():
        assert len(rows) == len(after.rows[table]), (name, table)
    run_commands(other, folder)
    if whole.name == "killed":
        try:
            _check_continued(name, other)
        except RecordError as error:
            # Without its last lines, or with a journal of which nothing is left.
            found = (name.split("/")[0], error.code)
            assert found in (("manifest.jsonl", "record.damaged"), ("open", "record.not-continuable"))
    return name.split("/")[0]


def _check_rows(name: str, kind: str, before: Seen, after: Seen) -> None:
    """What is lost is what was named, or at least that where the message says so, and it was in that file."""
    named = dict.fromkeys(TABLES, 0)
    uncounted, at_least = name == "manifest.jsonl", False
    for damage in after.damages:
        for table, number in damage.details.get("rows", {}).items():
            named[table] += number
        places = damage.details.get("places", ())
        uncounted |= any(place["end"] is None for place in places)
        at_least |= any(place["at_least"] for place in places)
    for table in TABLES:
        rest = iter(before.rows[table])
        assert all(row in rest for row in after.rows[table]), (name, table)  # the same rows, in order
        lost = len(before.rows[table]) - len(after.rows[table])
        more = uncounted or (at_least and lost > named[table])
        assert lost == named[table] or more, (name, table, lost, after.damages)
    gone = [event for event in before.events if event not in after.events]
    assert not gone or name == "events.jsonl", name
    assert len(gone) <= 1 or kind != "bit"
    assert all(event in before.events for event in after.events), name


def _check_continued(name: str, path: Path) -> None:
    reported: list[Event] = []
    record_run(path, reported=reported)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamageWarning)
        run = RunRecord.open(path)
        number = pa.concat_tables(map(pa.table, run.tables("samples")))["sample"].to_numpy()
    damages = [event for event in reported if event.kind == "record-damaged"]
    damages += [damage for damage in run.damages if damage not in damages]
    continued = [event.sample for event in reported if event.kind == "record-continued"]
    places = [place for damage in damages for place in damage.details.get("places", ())]
    # What a damaged end held after its last commit comes again from the recording.
    again = sum(p["rows"].get("samples", 0) for p in places if p["begin"] and p["begin"][0] in continued)
    lost = sum(damage.details.get("rows", {}).get("samples", 0) for damage in damages) - again
    assert run.finished
    assert np.array_equal(number, np.unique(number))
    assert number[0] == 0 or lost
    assert number[-1] == SAMPLES - 1
    assert number.size == SAMPLES - lost, (name, reported)
