"""Small segments are merged as a run ages: no moment of it loses a row, and readers in between miss none."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from livebode.records import RunRecord, query
from livebode.records.segments import reading
from livebode.tables import Table
from tests.support.failing_disk import cut, disk_that
from tests.support.long_runs import noisy_responses, record_long

SECONDS, SEGMENT_S = 40, 2.0
RESPONSES = noisy_responses(SECONDS, seed=4)


@pytest.fixture(autouse=True)
def _merge_four(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.records.segments.merging._FAN_IN", 4)
    monkeypatch.setattr("livebode.records.segments.shelf._LONG_BYTES", 4096)
    monkeypatch.setattr("livebode.records.segments.shelf._SHORTER", 1.2)


def names(run: Path) -> list[str]:
    return [segment.name for segment in RunRecord.open(run).segments if segment.table == "responses"]


def check(run: Path, end: int) -> None:
    """The record has all responses before this sample, once, and no other file than those of its manifest."""
    found = RunRecord.open(run).responses()
    expected = RESPONSES[np.flatnonzero(RESPONSES.sample < end)]
    assert found.sample.tolist() == expected.sample.tolist()
    np.testing.assert_array_equal(found.value, expected.value)


def test_merged_segments_have_the_same_rows_in_fewer_files(tmp_path: Path) -> None:
    record_long(tmp_path, SEGMENT_S, RESPONSES)
    assert "responses/000001-000016.parquet" in names(tmp_path)
    assert len(names(tmp_path)) < 20 / 3
    check(tmp_path, SECONDS * 40)
    files = {f"responses/{path.name}" for path in (tmp_path / "responses").iterdir()}
    assert files == set(names(tmp_path))
    for where in ("time_s BETWEEN 11 AND 14", "sample >= 440 AND sample < 560", "time_s > 39", "valid"):
        (rows,) = query(RunRecord.open(tmp_path), f"SELECT count(*) FROM responses WHERE {where}", 1).rows
        (every,) = query(
            RunRecord.open(tmp_path), f"SELECT count(*) FROM (SELECT * FROM responses OFFSET 0) WHERE {where}", 1
        ).rows
        assert rows == every


def test_a_reader_that_listed_the_segments_before_they_were_merged_reads_them(tmp_path: Path) -> None:
    half = RESPONSES[np.flatnonzero(RESPONSES.sample < 5 * 40)]
    record_long(tmp_path, SEGMENT_S, half, finished=False)
    before = [segment for segment in RunRecord.open(tmp_path).segments if segment.table == "responses"]
    batches = RunRecord.open(tmp_path).between(0.0, 4.0)
    record_long(tmp_path, SEGMENT_S, RESPONSES)
    assert not (tmp_path / before[0].name).exists()
    damages: list[object] = []
    for segment in before:
        table = Table.join(list(reading.segment_rows(tmp_path, segment, damages.append)))
        assert (table.num_rows, table["sample"][0]) == (segment.rows, segment.first_sample)
    assert not damages
    assert sum(len(part) for part in batches) == np.count_nonzero(RESPONSES.time_s <= 4.0)


def test_power_may_go_at_any_call_of_a_merge(tmp_path: Path) -> None:
    half = RESPONSES[np.flatnonzero(RESPONSES.sample < 6 * 40)]
    rest = RESPONSES[np.flatnonzero(RESPONSES.sample < 7 * 40)]
    memory = Path("/dev/shm")
    folder = memory / f"livebode-merging-{os.getpid()}" if os.access(memory, os.W_OK) else tmp_path / "runs"
    folder.mkdir()
    try:
        record_long(folder / "begun", SEGMENT_S, half, finished=False)
        merged = 0
        for at in range(1, 400):
            run = Path(shutil.copytree(folder / "begun", folder / str(at)))
            with disk_that(cut, at) as disk:
                try:
                    record_long(run, SEGMENT_S, rest)
                except BaseException:
                    assert disk.dead
            merged += any("-" in path.name for path in (run / "responses").iterdir())
            found = RunRecord.open(run).responses()
            assert found.sample.tolist() == RESPONSES.sample[: len(found)].tolist()
            assert len(found) >= len(half)
            if not RunRecord.open(run).finished:
                record_long(run, SEGMENT_S, rest)
            check(run, 7 * 40)
            files = {f"responses/{path.name}" for path in (run / "responses").iterdir()}
            assert files == set(names(run))
            shutil.rmtree(run)
            if not disk.dead:
                break
        else:
            raise AssertionError("no run was short enough to be done")
        assert merged > 10
    finally:
        shutil.rmtree(folder)


def test_a_damaged_segment_is_not_merged_and_costs_only_its_rows(tmp_path: Path) -> None:
    half = RESPONSES[np.flatnonzero(RESPONSES.sample < 5 * 40)]
    record_long(tmp_path, SEGMENT_S, half, finished=False)
    path = tmp_path / names(tmp_path)[1]
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    record_long(tmp_path, SEGMENT_S, RESPONSES)
    damages: list[object] = []
    found = RunRecord.open(tmp_path, damages.append).responses()
    assert len(damages) == 1
    missing = set(RESPONSES.sample.tolist()) - set(found.sample.tolist())
    assert missing == set(RESPONSES.sample[(RESPONSES.sample >= 80) & (RESPONSES.sample < 160)].tolist())
    said: list[object] = []
    rows = query(RunRecord.open(tmp_path, said.append), "SELECT count(DISTINCT sample) FROM responses", 1).rows
    assert (rows, len(said)) == ([(len(found),)], 1)
