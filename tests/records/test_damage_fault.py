"""A damaged record gives all that is not damaged and says exactly what is lost, or is refused with a sentence."""

from __future__ import annotations

import shutil
import struct
import time
import warnings
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import DamageWarning, Event, RecordError
from livebode.records import ColumnTable, RunRecord, frames, to_frame
from livebode.records.segments.damage import total
from livebode.records.segments.frames import COMMIT, ROWS, TABLE
from livebode.records.segments.journal import Commit, Journal, head, name_of, read_sealed
from livebode.records.segments.json_lines import in_line, to_line
from livebode.records.segments.manifest import TIERS
from livebode.tables import Schema, Table, to_message
from tests.support.errors import refused
from tests.support.recorded import check_beginning, expected, machine, record_machine, same

SAMPLES = 2600
TABLES = {name: ColumnTable(Schema.of(sample="int64", time_s="float64")) for name in "ab"}


@dataclass(frozen=True)
class Piece:
    """A frame of the journal below: whose rows it holds, or which commit it is; None in its head."""

    start: int
    end: int
    table: str | None
    commit: int | None


def commit(number: int) -> Commit:
    rows = {"a": number, "b": number}
    states = {"one": bytes([number] * number), "two": b"\0"}
    return Commit(10 * number, float(number), 0.0, 10 * number, states, rows)


def journal_of(commits: int) -> tuple[bytes, list[Piece]]:
    """A journal with a row of both tables before each commit, and its frames."""
    data, pieces = head(TABLES, commit(0)), []
    pieces.append(Piece(0, len(data), None, None))
    for k in range(1, commits + 1):
        rows = to_message(Table.of({"sample": np.array([10 * k - 1]), "time_s": np.array([k - 0.1])}))
        for at, table in enumerate("ab"):
            frame = to_frame(ROWS, rows, table=at)
            pieces.append(Piece(len(data), len(data) + len(frame), table, k))
            data += frame
        frame = commit(k).to_frame()
        pieces.append(Piece(len(data), len(data) + len(frame), None, k))
        data += frame
    return data, pieces


COMMITS = 6
WHOLE, PIECES = journal_of(COMMITS)


def read(run: Path, data: bytes) -> Journal:
    (run / "open").mkdir(parents=True, exist_ok=True)
    (run / name_of(1)).write_bytes(data)
    return Journal.read(run, 1)


def rows_of(found: Journal, table: str) -> list[int]:
    return [(sample + 1) // 10 for batch in found.rows.get(table, []) for sample in batch["sample"].tolist()]


@settings(deadline=None)
@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_a_changed_byte_costs_what_its_frame_held_and_is_counted(
    tmp_path_factory: pytest.TempPathFactory, at: int, change: int
) -> None:
    data = bytearray(WHOLE)
    data[at] ^= change
    found = read(tmp_path_factory.getbasetemp() / "changed", bytes(data))
    hit = next(piece for piece in PIECES if piece.start <= at < piece.end)
    last = COMMITS - (hit.table is None and hit.commit == COMMITS)
    assert found.commit == commit(last)
    for table in "ab":
        assert rows_of(found, table) == [k for k in range(1, last + 1) if (table, k) != (hit.table, hit.commit)]
    behind = {"a": 1, "b": 1} if last < COMMITS else {}
    assert [place.rows for place in found.damages] == [{hit.table: 1} if hit.table else behind]
    if hit.commit is not None:
        k = hit.commit
        # Where a commit is what is damaged, the one behind it follows; of the last the rows before it tell the end.
        end = k if hit.table or k == COMMITS else k + 1
        assert found.damages[0].begin == (10 * (k - 1), k - 1)
        assert found.damages[0].end == pytest.approx((10 * end, end))
        # What a frame was is not known where its header is damaged.
        assert found.damages[0].at_least == (last < COMMITS and at < hit.start + 16)


@settings(deadline=None)
@given(st.integers(0, len(WHOLE)))
def test_a_torn_journal_ends_at_its_last_commit_and_is_not_damaged(
    tmp_path_factory: pytest.TempPathFactory, at: int
) -> None:
    found = read(tmp_path_factory.getbasetemp() / "torn", WHOLE[:at])
    commits = [piece.commit for piece in PIECES if piece.table is None and piece.end <= at]
    if commits:
        assert found.commit == commit(commits[-1] or 0)
        assert found.length == max(p.end for p in PIECES if p.table is None and p.end <= at)
        assert rows_of(found, "a") == rows_of(found, "b") == list(range(1, 1 + (commits[-1] or 0)))
    assert found.damages == []


@settings(deadline=None)
@given(st.integers(PIECES[0].end, len(WHOLE) - 40), st.integers(1, 5000))
def test_a_lost_stretch_of_a_journal_is_counted(tmp_path_factory: pytest.TempPathFactory, at: int, length: int) -> None:
    found = read(tmp_path_factory.getbasetemp() / "stretch", WHOLE[:at] + bytes(length) + WHOLE[at + length :])
    for table in "ab":
        assert sorted(set(rows_of(found, table))) == rows_of(found, table)
    if found.commit == commit(COMMITS):
        lost = {table: COMMITS - len(rows_of(found, table)) for table in "ab"}
        assert total(found.damages)["rows"] == {table: n for table, n in lost.items() if n}


def test_rows_behind_a_damaged_end_are_counted_as_far_as_they_are_known(tmp_path: Path) -> None:
    data = bytearray(WHOLE)
    for piece in PIECES[-2:]:
        data[piece.start + 30] ^= 1
    (place,) = read(tmp_path, bytes(data)).damages
    assert (dict(place.rows), place.at_least, place.end) == ({"a": 1}, True, (60, pytest.approx(6.0)))
    assert place.sentence == "at least 1 rows of a are lost, of samples 50 to 59 (1 s)"
    data = bytearray(WHOLE)
    data[PIECES[-1].start + 30] ^= 1
    torn = journal_of(COMMITS + 1)[0][len(WHOLE) :]
    (place,) = read(tmp_path, bytes(data) + torn[: len(torn) - 1]).damages
    assert (dict(place.rows), place.at_least) == ({"a": 1, "b": 1}, False)


@pytest.mark.parametrize("attack", ["compressed", "null", "shared", "sparse"])
def test_a_journal_that_expands_is_refused_in_a_sentence(tmp_path: Path, attack: str) -> None:
    rows, columns = (1000, 50) if attack == "shared" else (1 << 20, 2)
    schema = pa.schema([("sample", pa.null() if attack == "null" else pa.int64()) for _ in range(columns)])
    zeros = pa.nulls(rows) if attack == "null" else pa.array(np.zeros(rows, dtype=np.int64))
    batch = pa.record_batch([zeros] * columns, schema=schema)
    options = pa.ipc.IpcWriteOptions(compression="zstd" if attack == "compressed" else None)
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, schema, options=options) as writer:
        writer.write_batch(batch)
    reader = pa.ipc.MessageReader.open_stream(sink.getvalue())
    reader.read_next_message()
    message = reader.read_next_message().serialize().to_pybytes()
    if attack == "shared":  # every column's buffer is made the first one's
        for column in range(1, columns):
            before, own, behind = message.rpartition(struct.pack("<qq", 8 * rows * column, 8 * rows))
            message = before + struct.pack("<qq", 0, 8 * rows) * bool(own) + behind
        message = message.replace(struct.pack("<q", 8 * rows * columns), struct.pack("<q", 8 * rows), 1)
        message = message[: -8 * rows * (columns - 1)]
        assert pa.ipc.read_record_batch(pa.py_buffer(message), schema).nbytes > 30 * len(message)
    data = b"".join([to_frame(TABLE, b"a\0", schema.serialize()), to_frame(ROWS, message), commit(1).to_frame()])
    (tmp_path / "open").mkdir()
    with (tmp_path / name_of(1)).open("wb") as file:
        file.write(data)
        if attack == "sparse":
            file.truncate(64 << 30)
    with refused(RecordError, "too-large" if attack == "sparse" else "unexpected-content"):
        Journal.read(tmp_path, 1)


@pytest.mark.parametrize("name", ["run.json", "run-copy.json"])
def test_a_damaged_file_is_reported_once_and_a_clock_that_was_set_back_is_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def stop(done: int, _: int | None) -> None:
        if done > 600:
            raise StopError

    run, reported = tmp_path / "run", list[Event]()
    with pytest.raises(StopError):
        record_machine(machine(SAMPLES), run, progress=stop)
    data = bytearray((run / name).read_bytes())
    data[len(data) // 2] ^= 1
    (run / name).write_bytes(data)
    now = time.time
    monkeypatch.setattr(time, "time", lambda: now() - 3600)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        record_machine(machine(SAMPLES), run, report=reported.append)
    damaged = [event.message for event in reported if event.kind == "record-damaged"]
    assert len(damaged) + len(warned) == 1
    (continued,) = [event for event in reported if event.kind == "record-continued"]
    assert "this computer's clock was set back, so" in continued.message
    assert continued.details["away_s"] is None


def test_the_next_journal_gives_the_rows_of_a_damaged_end(tmp_path: Path) -> None:
    data = bytearray(WHOLE)
    data[PIECES[-1].start + 30] ^= 1
    data[PIECES[-2].start + 30] ^= 1
    read(tmp_path, bytes(data))
    (tmp_path / name_of(2)).write_bytes(head(TABLES, commit(COMMITS)))
    found = read_sealed(tmp_path, 1)
    assert rows_of(found, "a") == list(range(1, COMMITS + 1))
    assert rows_of(found, "b") == list(range(1, COMMITS))
    assert [place.rows for place in found.damages] == [{"b": 1}]


@given(st.binary(max_size=200))
def test_frames_of_anything_end_somewhere(data: bytes) -> None:
    found = list(frames(to_frame(COMMIT, data) + data))
    assert found[0].payload == data
    assert all(a.end == b.start for a, b in pairwise(found))


@given(
    st.lists(st.dictionaries(st.text(min_size=1), st.text() | st.integers() | st.floats(allow_nan=False), min_size=1))
)
def test_objects_come_back_where_the_line_ends_between_them_are_damaged(values: list[dict[str, object]]) -> None:
    lines = [to_line(value) for value in values]
    finite = [{k: None if v in (np.inf, -np.inf) else v for k, v in value.items()} for value in values]
    assert [found for line in lines for found in in_line(line)] == finite
    joined = b"*".join(line[:-1] for line in lines)
    assert [found for found in in_line(joined) if isinstance(found, dict)] == finite


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("finished") / "run"
    record_machine(machine(SAMPLES), run)
    return run


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_changed_file_of_a_finished_run_is_reported_and_the_rest_is_read(finished: Path, data: st.DataObject) -> None:
    files = sorted(p.relative_to(finished) for p in finished.rglob("*") if p.suffix in (".parquet", ".jsonl", ".json"))
    name = data.draw(st.sampled_from(files))
    other = finished.with_name("changed")
    shutil.rmtree(other, ignore_errors=True)
    shutil.copytree(finished, other)
    content = bytearray((other / name).read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    (other / name).write_bytes(content)
    whole = RunRecord.open(finished)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamageWarning)
        run = RunRecord.open(other)
        found = run.responses(), run.events(), list(map(pa.table, run.tables("samples")))
        for tier in TIERS:
            list(map(pa.table, run.tables(tier)))
    reported = [str(damage.details["file"]) for damage in run.damages]
    assert reported == [str(name)] * max(len(reported), 1)
    segment = next((s for s in whole.segments if s.name == str(name)), None)
    lost = dict.fromkeys(("responses", "samples"), 0) | ({segment.table: segment.rows} if segment else {})
    assert len(found[0]) == len(whole.responses()) - lost["responses"] // len(whole.lines)
    assert sum(t.num_rows for t in found[2]) == SAMPLES - lost["samples"]
    kept = [event for event in found[1] if event.kind != "record-damaged"]
    assert len(whole.events()) - len(kept) == (name.name == "events.jsonl" and kept != whole.events())


def flip(path: Path, at: float) -> None:
    content = bytearray(path.read_bytes())
    content[int(at * len(content))] ^= 4
    path.write_bytes(content)


class StopError(Exception):
    pass


@pytest.mark.parametrize("at", [0.2, 0.5, 0.8])
def test_a_run_with_a_damaged_journal_is_continued_behind_the_damage(tmp_path: Path, at: float) -> None:
    def stop(done: int, _: int | None) -> None:
        if done > 1900:
            raise StopError

    run = tmp_path / "run"
    with pytest.raises(StopError):
        record_machine(machine(SAMPLES), run, progress=stop)
    held = check_beginning(run, SAMPLES, 1000)
    journals = sorted((run / "open").iterdir())
    content = journals[-1].read_bytes()
    commits = [frame for frame in frames(content) if frame.kind == COMMIT]
    flip(journals[-1], at * commits[-1].start / len(content))  # before the last commit, however long a state is
    reported: list[Event] = []
    record_machine(machine(SAMPLES), run, report=reported.append)
    assert [event.kind for event in reported] == ["record-continued", "record-damaged"]
    assert reported[0].sample == held
    check_damage(run, reported[1], journals[-1].name)
    with refused(RecordError, "finished", path=str(run)):
        record_machine(machine(SAMPLES), run)


def check_damage(run: Path, reported: Event, journal: str) -> None:
    """That exactly what the event says is missing, and everything else is there."""
    assert reported in RunRecord.open(run).events()
    assert (run / "damaged" / journal).exists()
    details = reported.details
    place = details["places"][0]
    assert RunRecord.open(run).summary["record"]["damaged"] == {
        "files": [f"damaged/{journal}"], **{key: details[key] for key in ("samples", "seconds", "rows")},
    }  # fmt: skip
    number = np.concatenate(
        [table["sample"].to_numpy() for table in map(pa.table, RunRecord.open(run).tables("samples"))]
    )
    lost = np.setdiff1d(np.arange(SAMPLES), number)
    assert lost.size == details["rows"].get("samples", 0)
    responses = RunRecord.open(run).responses()
    due = expected(SAMPLES)[0]
    gone = ~np.isin(due.sample, responses.sample)
    assert np.count_nonzero(gone) * len(due.lines) == details["rows"].get("responses", 0)
    assert same(responses, due[~gone])
    for sample in (*lost, *due.sample[gone]):
        assert place["begin"][0] <= sample < place["end"][0]


def test_a_journal_that_is_damaged_while_the_process_runs_is_closed_without_what_is_lost(tmp_path: Path) -> None:
    run = tmp_path / "run"

    def each(start: int) -> None:
        if start == 850:
            flip(run / "open" / "000001.journal", 0.6)

    reported: list[Event] = []
    record_machine(machine(SAMPLES, each), run, report=reported.append)
    assert [event.kind for event in reported] == ["record-damaged"]
    check_damage(run, reported[0], "000001.journal")
    assert reported[0].details["rows"]
    assert "are lost" in reported[0].message


def test_a_lost_journal_is_reported(tmp_path: Path) -> None:
    def stop(done: int, _: int | None) -> None:
        if done > 1500:
            raise KeyError

    with pytest.raises(KeyError):
        record_machine(machine(SAMPLES), tmp_path / "run", progress=stop)
    check_beginning(tmp_path / "run", SAMPLES, 500)
    for path in (tmp_path / "run" / "open").iterdir():
        path.write_bytes(b"rubbish")
    with refused(RecordError, "not-continuable"):
        record_machine(machine(SAMPLES), tmp_path / "run")
    with pytest.warns(DamageWarning, match="its first 7 bytes are lost"):
        check_beginning(tmp_path / "run", SAMPLES, 1000)  # what is closed can be read all the same
