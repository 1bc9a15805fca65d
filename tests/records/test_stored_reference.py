"""Runs that were stored by every version of the formats are read with the same values by this one."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from livebode.core import Block, Lines, RecordError, StateError
from livebode.estimation import Tracker
from livebode.monitoring import Baseline, Monitor
from livebode.records import RUN, RunRecord, last_commit, read_summary, to_frame
from livebode.records.json_format import VERSIONS, format_of
from livebode.records.segments.frames import FORMAT
from livebode.records.segments.json_lines import to_line
from livebode.records.segments.recovery import recover
from livebode.records.summary_file import COPY, to_document
from tests.support import stored, stored_matrix
from tests.support.errors import refused
from tests.support.recorded import NAMES
from tests.support.stateful_cases import MONITORED

STORED = sorted((Path(__file__).parent / "stored").glob("[0-9]*"))


@pytest.fixture(params=STORED, ids=lambda path: path.name)
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A copy of one of them."""
    return Path(shutil.copytree(request.param, tmp_path / "stored"))


def test_an_unfinished_run_is_read_exactly(folder: Path) -> None:
    run = RunRecord.open(folder / "segments")
    responses = run.responses()
    assert (run.finished, run.lines) == (False, Lines((2, 5), 20, 400.0, run.lines.quiet))
    assert (len(responses), responses.sample[-1], responses.unit) == (32, 639, "")
    expected = json.loads((folder / "expected.json").read_text())
    assert stored.content(responses) == expected["responses"]
    tables = map(pa.table, run.tables("samples"))
    samples = np.concatenate([np.array([table[name] for name in NAMES]) for table in tables], axis=1)
    assert stored.digest(samples) == expected["samples"]
    assert [(event.kind, event.sample) for event in run.events()] == [("non-finite", 300)]
    assert [(segment.table, segment.rows) for segment in run.segments] == [("samples", 450), ("responses", 44)]
    assert run.damages == []


def test_its_state_of_an_older_version_is_refused() -> None:
    commit = last_commit(STORED[-1] / "segments")
    assert commit is not None
    assert (commit.sample, commit.events_bytes, commit.waiting) == (650, 263, ())
    with refused(StateError, "older-version", name="line-spectra"):
        Tracker(stored.SETTINGS).restore(commit.states["tracker"])


def test_the_state_of_such_a_run_continues_with_the_responses_of_a_run_without_end(tmp_path: Path) -> None:
    stored.in_segments(tmp_path / "segments")
    commit = last_commit(tmp_path / "segments")
    assert commit is not None
    assert 0 < commit.sample < stored.ENDS_AT
    tracker = Tracker(stored.SETTINGS)
    tracker.restore(commit.states["tracker"])
    rest = tracker.process(Block(stored.data()[:, commit.sample :], NAMES, stored.RATE_HZ, start=commit.sample))
    whole = Tracker(stored.SETTINGS).process(Block(stored.data(), NAMES, stored.RATE_HZ))
    for name in stored.ARRAYS:
        np.testing.assert_allclose(getattr(rest, name), getattr(whole[whole.sample >= commit.sample], name), rtol=1e-12)


def test_a_finished_run_is_read_exactly(folder: Path) -> None:
    run = RunRecord.open(folder / "piece")
    responses = run.responses()
    assert (run.finished, len(responses), int(responses.valid.sum())) == (True, 30, 58)
    assert responses.time_s[-1] == 1.47375
    last = [-0.03821601125010516 - 0.09665834465355533j, -0.035937500000000004 - 0.03125j]
    assert responses.value[-1].tolist() == last
    rows = [row for table in map(pa.table, run.tables("parameters")) for row in table.to_pylist()]
    assert len(rows) == 90
    assert (rows[-3]["name"], rows[-3]["value"], rows[-3]["status"]) == ("J", 0.03837103485160787, "ok")
    assert [event.kind for event in run.events()].count("fit-failed") == 3
    assert (run.summary["counts"]["samples"], run.summary["configuration"]["lines"]["window"]) == (600, 20)
    assert run.damages == []


def test_a_matrix_run_is_read_exactly() -> None:
    folder = Path(__file__).parent / "stored" / "matrix-3"
    run = RunRecord.open(folder / "piece", matrix=True)
    matrix = run.matrix()
    assert stored_matrix.content(matrix) == json.loads((folder / "expected.json").read_text())
    assert (len(matrix), matrix.outputs, matrix.inputs) == (12, ("y1", "y2"), ("u1", "u2"))
    assert (
        RunRecord.open(folder / "piece", entry="y2/u1")
        .responses()
        .equals(replace(matrix.entry("y2", "u1"), unit="rad/s/(N m)"))
    )
    assert run.damages == []


def test_a_baseline_is_read_exactly(folder: Path) -> None:
    found = Baseline.load(folder / "baseline.json")
    assert found.machine is not None
    assert found.machine.model.inertia_kg_m2 == 0.0028
    assert found.tables[0].names[0] == "20 Hz"
    assert Monitor(found, MONITORED).summary()["judged_by"] == "model"


@pytest.mark.parametrize("name", ["run", "manifest", "journal"])
@pytest.mark.parametrize(("step", "code"), [(1, "newer-version"), (-1, "older-version")])
def test_a_run_of_another_livebode_is_refused_in_one_sentence(name: str, step: int, code: str, tmp_path: Path) -> None:
    run = Path(shutil.copytree(STORED[-1] / "segments", tmp_path / "run"))
    renumber(run, name, VERSIONS[name] + step)
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    with refused(RecordError, code, format=name, found=VERSIONS[name] + step, readable=VERSIONS[name]):
        RunRecord.open(run).responses()
    with refused(RecordError, code, format=name):
        recover(run)
    assert before == {path: path.read_bytes() for path in before}


def renumber(run: Path, name: str, version: int) -> None:
    """Give this part of the record another version."""
    other = format_of(name) | {"version": version}
    if name == "run":
        for file in (RUN, COPY):
            (run / file).write_bytes(to_document(read_summary(run)[0] | other))
    elif name == "manifest":
        file = run / "manifest.jsonl"
        file.write_bytes(file.read_bytes().replace(to_line(format_of(name)), to_line(other)))
    else:
        file = run / "open/000002.journal"
        old, new = (to_frame(FORMAT, json.dumps(text).encode()) for text in (format_of(name), other))
        file.write_bytes(file.read_bytes().replace(old, new))
