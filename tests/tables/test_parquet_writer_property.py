"""Parquet files that are written group by group: every reader finds the rows, the groups and what they are about."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.tables import Field, Schema, Table, Text
from livebode.tables.parquet_writer import ParquetWriter
from livebode.tables.thrift import BINARY, DOUBLE, I64, LIST, STRUCT, TRUE, Value, decode, encode

SCHEMA = Schema(
    (Field("sample", "int64"), Field("u", "float64", {"unit": "V"}), Field("ready", "bool"), Field("name", "string")),
    {"rate_hz": "4000"},
)


def rows(start: int, count: int) -> Table:
    sample = np.arange(start, start + count)
    return Table(SCHEMA, (sample, np.sin(sample), sample % 3 > 0, Text.of(["Keff", "δ"], sample % 2)))


def written(counts: list[int]) -> bytes:
    sink = io.BytesIO()
    writer = ParquetWriter(sink, SCHEMA, ["name"])
    for number, count in enumerate(counts):
        writer.write(rows(sum(counts[:number]), count))
    writer.close()
    return sink.getvalue()


@given(st.lists(st.integers(0, 300), max_size=6))
@settings(max_examples=25)
def test_pyarrow_reads_the_rows_the_groups_and_their_statistics(counts: list[int]) -> None:
    file = pq.ParquetFile(pa.BufferReader(written(counts)), page_checksum_verification=True)
    assert Table.from_arrow(file.read()).equals(rows(0, sum(counts)))
    filled = [count for count in counts if count]
    groups = [file.metadata.row_group(number) for number in range(file.num_row_groups)]
    assert [group.num_rows for group in groups] == filled
    firsts = [0, *np.cumsum(filled).tolist()]
    assert [group.column(0).statistics.min for group in groups] == firsts[: len(filled)]
    assert [file.read_row_group(k)["sample"][0].as_py() for k in range(len(filled))] == firsts[: len(filled)]


def test_text_has_a_dictionary_and_numbers_have_none() -> None:
    group = pq.ParquetFile(pa.BufferReader(written([5, 300]))).metadata.row_group(1)
    assert [group.column(k).has_dictionary_page for k in range(4)] == [False, False, False, True]
    assert {group.column(k).compression for k in range(4)} == {"LZ4"}


def test_duckdb_reads_a_part_by_its_statistics(tmp_path: Path) -> None:
    (tmp_path / "a.parquet").write_bytes(written([50, 70, 1]))
    with duckdb.connect() as database:
        found = database.execute(
            f"select count(*), min(sample), max(name) from '{tmp_path}/a.parquet' where sample >= 50"
        ).fetchone()
    assert found == (71, 50, "δ")


def test_another_schema_is_refused() -> None:
    with pytest.raises(ValueError, match="another schema"):
        ParquetWriter(io.BytesIO(), SCHEMA).write(Table.of({"a": np.zeros(2)}))


PLAIN: Any = st.one_of(
    st.integers(-(2**63), 2**63 - 1).map(lambda n: Value(I64, n)),
    st.binary(max_size=20).map(lambda b: Value(BINARY, b)),
    st.floats(allow_nan=False).map(lambda x: Value(DOUBLE, x)),
    st.just(Value(TRUE, True)),
)
STRUCTS: Any = st.recursive(
    st.dictionaries(st.integers(1, 500), PLAIN, max_size=5),
    lambda inner: st.dictionaries(
        st.integers(1, 30),
        st.one_of(
            PLAIN,
            inner.map(lambda fields: Value(STRUCT, fields)),
            st.lists(inner, max_size=20).map(lambda items: Value(LIST, (STRUCT, items))),
        ),
        max_size=4,
    ),
    max_leaves=6,
)


@given(STRUCTS)
@settings(max_examples=60)
def test_a_struct_of_thrift_comes_back(fields: Any) -> None:
    assert decode(encode(fields)) == fields


@given(st.binary(max_size=60), st.integers(0, 2000))
@settings(max_examples=150)
def test_damaged_thrift_is_a_value_error(noise: bytes, at: int) -> None:
    data = written([3])[-1500:-8]
    for damaged in (noise, data[: at % len(data)] + noise + data[at % len(data) :]):
        try:
            decode(damaged)
        except ValueError:
            continue
