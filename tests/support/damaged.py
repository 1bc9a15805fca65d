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

from livebode.configuration.fit_section import FitSection
from livebode.configuration.record_section import RecordSection
from livebode.core import DamageWarning, Event, LivebodeError, UsageError
from livebode.dashboard.state import State
from livebode.dashboard.viewed import Viewed
from livebode.estimation import Tracker
from livebode.records import RunRecord
from livebode.records.query import query
from livebode.reporting.run_report import run_report
from livebode.runtime import Document
from livebode.runtime.documents import TrackerResults
from livebode.runtime.fits import Fits
from tests.support.command import livebode
from tests.support.recorded import SETTINGS, machine
from tests.support.runs import record

SAMPLES, STOPPED = 2600, 1900
TABLES = ("responses", "responses_1s", "responses_1min", "responses_1h", "parameters", "samples")
CONFIGURATION = {"signals": {"output": "y", "input": "u", "excitation": "w"}}
FIT = FitSection(fixed={"resonance_damping": 0.1, "antiresonance_damping": 0.1, "delay": 0.0})
KEPT = RecordSection(samples=True, segment_s=1.0)
_MOST = 10_000_000
_NAMED_NOT = ("run-copy.json",)
"""Read only where run.json is damaged too."""


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
        patch.setattr("livebode.records.table_file._GROUP_ROWS", 400)
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
            except UsageError as error:
                if "does not exist" not in error.reason:
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
        "view": lambda: Viewed(path).fill(State(path.name, 0)),
        "report": lambda: run_report(path, None, made=datetime(2026, 1, 1, tzinfo=UTC)),
    }


def run_commands(path: Path, out: Path) -> None:
    """Every other command."""
    for call in commands(path, out).values():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DamageWarning)
            with contextlib.suppress(LivebodeError):
                call()


def flip(path: Path, rng: np.random.Generator) -> str:
    """Flip one bit of a random file; its name. Small files are as likely as large ones."""
    files = sorted(p for p in path.rglob("*") if p.is_file() and p.stat().st_size)
    file = files[rng.integers(len(files))]
    content = bytearray(file.read_bytes())
    content[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
    file.write_bytes(content)
    return file.relative_to(path).as_posix()


def check_flip(whole: Path, folder: Path, rng: np.random.Generator) -> tuple[str, bool]:
    """Flip a bit in a copy of a run and let everything read it: the kind of file, and whether the flip was named."""
    other = folder / "flipped"
    shutil.rmtree(other, ignore_errors=True)
    shutil.copytree(whole, other)
    name = flip(other, rng)
    before, after = seen(whole), seen(other)
    files = {str(damage.details["file"]) for damage in after.damages}
    assert files <= {name}, (name, after.damages)
    assert bool(files) == (name not in _NAMED_NOT), name
    _check_rows(name, before, after)
    for table, rows in by_query(other).items():
        assert len(rows) == len(after.rows[table]), (name, table)
    run_commands(other, folder)
    if whole.name == "killed":
        _check_continued(name, other)
    return name.split("/")[0], bool(files)


def _check_rows(name: str, before: Seen, after: Seen) -> None:
    """What is lost is what was named, and it was in that file."""
    named = dict.fromkeys(TABLES, 0)
    uncounted = False
    for damage in after.damages:
        for table, number in damage.details.get("rows", {}).items():
            named[table] += number
        uncounted |= any(place["end"] is None for place in damage.details.get("places", ()))
    for table in TABLES:
        rest = iter(before.rows[table])
        assert all(row in rest for row in after.rows[table]), (name, table)  # the same rows, in order
        lost = len(before.rows[table]) - len(after.rows[table])
        assert lost == named[table] or uncounted, (name, table, lost, after.damages)
    gone = [event for event in before.events if event not in after.events]
    assert len(gone) <= (name == "events.jsonl"), name
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
