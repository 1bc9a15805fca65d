"""The checksums that a table file notes while a thread writes are those of its row groups."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.records import ColumnTable
from livebode.records.segments import segment_writer
from livebode.records.segments.manifest import Segment
from livebode.records.segments.segment_writer import TableFile
from livebode.tables import Schema, Table
from tools.parquet_parts import segment_of

TABLE = ColumnTable(Schema.of(sample="int64", time_s="float64", re="float64"), ("time_s",))


def rows(first: int, count: int) -> Table:
    sample = np.arange(first, first + count)
    return Table(TABLE.schema, (sample, sample // 7 / 100, np.sin(sample)))


@given(st.lists(st.integers(0, 60), max_size=30), st.integers(1, 100))
@settings(max_examples=25)
def test_the_parts_are_those_of_the_written_file(
    tmp_path_factory: pytest.TempPathFactory, counts: list[int], group: int
) -> None:
    path = tmp_path_factory.mktemp("table") / "responses.parquet"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(segment_writer, "GROUP_ROWS", group)
        file = TableFile(path, TABLE)
        for number, count in enumerate(counts):
            file.write(rows(sum(counts[:number]), count))
        segment = file.close()
    assert segment == segment_of(path)
    assert segment.size_bytes == path.stat().st_size
    assert Segment.of(1, 1, json.loads(json.dumps(asdict(segment)))) == segment
    assert pq.read_table(path)["sample"].to_pylist() == list(range(sum(counts)))
    assert file.close() == segment


def test_the_error_of_a_group_is_raised_by_the_next_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(segment_writer, "GROUP_ROWS", 10)
    other = Table.of({"sample": np.arange(10.0)})
    file = TableFile(tmp_path / "responses.parquet", TABLE)
    file.write(other)
    with pytest.raises(ValueError, match="columns"):
        file.write(rows(0, 10))
    file.close()
