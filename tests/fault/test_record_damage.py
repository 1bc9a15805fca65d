"""A damaged record gives what was committed before the damage, or is refused with a sentence; never anything else."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.nouns import InputError
from livebode.records import Run
from livebode.records.segments.frames import COMMIT, ROWS, to_frame, whole_frames
from livebode.records.segments.journal import Commit, Journal, head
from livebode.records.segments.json_lines import to_line, whole_lines
from livebode.records.table import Table
from tests.recorded import check_beginning, machine, record_machine

SAMPLES = 2600
TABLE = Table(pa.schema([("sample", pa.int64()), ("time_s", pa.float64())]))


def journal_of(commits: int) -> tuple[bytes, list[int]]:
    """A journal, and the end of each of its commits."""
    data, ends = head({"a": TABLE, "b": TABLE}), []
    for k in range(commits):
        for at in range(2):
            rows = pa.record_batch([pa.array([k]), pa.array([k / 2])], schema=TABLE.schema)
            data += to_frame(ROWS, rows.serialize(), table=at)
        data += Commit(k + 1, (k + 1) / 2, 0.0, 10 * k, {"one": bytes([k] * k), "two": b"\0"}).to_frame()
        ends.append(len(data))
    return data, ends


WHOLE, ENDS = journal_of(6)


def check(path: Path, data: bytes, changed_at: int) -> None:
    path.write_bytes(data)
    found = Journal.read(path)
    commits = sum(end <= changed_at for end in ENDS)
    assert found.length == ([0, *ENDS])[commits]
    if commits:
        assert found.commit is not None
        assert (found.commit.sample, found.commit.events_bytes) == (commits, 10 * (commits - 1))
        assert found.commit.states == {"one": bytes([commits - 1] * (commits - 1)), "two": b"\0"}
        for name in ("a", "b"):
            table = pa.Table.from_batches(found.rows[name])
            assert table["sample"].to_pylist() == list(range(commits))
    else:
        assert (found.commit, found.rows) == (None, {})


@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_a_changed_byte_ends_the_journal_at_the_commit_before(
    tmp_path_factory: pytest.TempPathFactory, at: int, change: int
) -> None:
    data = bytearray(WHOLE)
    data[at] ^= change
    check(tmp_path_factory.getbasetemp() / "changed", bytes(data), at)


@given(st.integers(0, len(WHOLE)), st.binary(max_size=40))
def test_a_torn_journal_ends_at_its_last_commit(tmp_path_factory: pytest.TempPathFactory, at: int, rest: bytes) -> None:
    if WHOLE[at:].startswith(rest):
        rest = b""
    check(tmp_path_factory.getbasetemp() / "torn", WHOLE[:at] + rest, at)


@given(st.binary(max_size=200))
def test_frames_of_anything_end_somewhere(data: bytes) -> None:
    assert next(bytes(payload) for *_, payload, _ in whole_frames(to_frame(COMMIT, data) + data)) == data


@given(
    st.lists(st.dictionaries(st.text(min_size=1), st.text() | st.integers() | st.floats(allow_nan=False), min_size=1))
)
def test_lines_come_back_and_a_damaged_one_ends_them(values: list[dict[str, object]]) -> None:
    lines = [to_line(value) for value in values]
    data = b"".join(lines)
    finite = [{k: None if v in (np.inf, -np.inf) else v for k, v in value.items()} for value in values]
    assert whole_lines(data) == (finite, len(data))
    if lines:
        assert whole_lines(data[:-2]) == (finite[:-1], len(data) - len(lines[-1]))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("finished") / "run"
    record_machine(machine(SAMPLES), run)
    return run


@settings(max_examples=60)
@given(data=st.data())
def test_a_changed_file_of_a_finished_run_is_told(finished: Path, data: st.DataObject) -> None:
    files = sorted(path.relative_to(finished) for path in finished.rglob("*") if path.suffix in (".parquet", ".jsonl"))
    name = data.draw(st.sampled_from(files))
    other = finished.with_name("changed")
    shutil.rmtree(other, ignore_errors=True)
    shutil.copytree(finished, other)
    content = bytearray((other / name).read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    (other / name).write_bytes(content)
    run = Run.open(other)
    with pytest.raises(InputError, match=r"is damaged|cannot be read"):
        print(len(run.responses()), len(run.events()), len(list(run.tables("samples"))))


def test_a_lost_journal_is_told(tmp_path: Path) -> None:
    def stop(done: int, _: int | None) -> None:
        if done > 1500:
            raise KeyError

    with pytest.raises(KeyError):
        record_machine(machine(SAMPLES), tmp_path / "run", progress=stop)
    check_beginning(tmp_path / "run", SAMPLES, 500)
    for path in (tmp_path / "run" / "open").iterdir():
        path.write_bytes(b"rubbish")
    with pytest.raises(InputError, match="no whole journal"):
        record_machine(machine(SAMPLES), tmp_path / "run")
    check_beginning(tmp_path / "run", SAMPLES, 1000)  # what is closed can be read all the same
