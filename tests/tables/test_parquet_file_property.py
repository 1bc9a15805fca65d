"""Parquet files of every writer, type, codec and layout: the same rows, schema and statistics as PyArrow reads."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from arro3 import io as arrow_io
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.tables.parquet_file import ParquetFile

KINDS = [
    pa.float64(), pa.float32(), pa.int64(), pa.int32(), pa.int16(), pa.uint8(), pa.uint64(), pa.bool_(), pa.string(),
    pa.timestamp("us", "UTC"), pa.timestamp("ns"), pa.duration("ms"), pa.list_(pa.float64()),
    pa.list_(pa.float32(), 2), pa.dictionary(pa.int32(), pa.string()), pa.decimal128(9, 2),
    pa.struct([("re", pa.float64()), ("n", pa.list_(pa.int32()))]),
]  # fmt: skip
PHYSICAL = pa.float64(), pa.float32(), pa.int64(), pa.int32()


def column(kind: pa.DataType, rows: int, rng: np.random.Generator, nulls: bool) -> pa.Array[Any]:
    """Values of this type, and nulls among them."""
    if pa.types.is_dictionary(kind):
        return column(kind.value_type, rows, rng, nulls).dictionary_encode()
    if pa.types.is_struct(kind):
        parts = [column(one.type, rows, rng, nulls) for one in kind]
        return pa.StructArray.from_arrays(parts, fields=list(kind))
    if pa.types.is_floating(kind):
        values = list(rng.choice([*rng.standard_normal(40), -0.0, np.inf], rows))
    elif pa.types.is_list(kind):
        values = [list(rng.integers(0, 9, rng.integers(0, 4))) for _ in range(rows)]
    elif pa.types.is_fixed_size_list(kind):
        values = [[1.5, float(k)] for k in range(rows)]
    elif pa.types.is_string(kind):
        values = [f"µ{k % 5}" for k in range(rows)]
    elif pa.types.is_boolean(kind):
        values = [bool(one) for one in rng.random(rows) > 0.5]
    else:
        values = [int(one) for one in rng.integers(0, 100, rows)]
    return pa.array([None if nulls and rng.random() < 0.3 else one for one in values], kind)


@st.composite
def tables(draw: st.DrawFn) -> pa.Table:
    kinds = draw(st.lists(st.sampled_from(KINDS), min_size=1, max_size=6))
    rows, nulls = draw(st.integers(0, 300)), draw(st.booleans())
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    fields = [pa.field(f"c{at}", kind, metadata={"unit": "V"} if at % 2 else None) for at, kind in enumerate(kinds)]
    schema = pa.schema(fields, {"rate_hz": "4000"} if draw(st.booleans()) else None)
    return pa.table([column(kind, rows, rng, nulls) for kind in kinds], schema=schema)


def read(data: bytes, columns: list[int] | None, groups: list[int] | None, rows: int) -> tuple[ParquetFile, pa.Table]:
    file = ParquetFile(io.BytesIO(data))
    schema = pa.schema(file.schema)
    chosen = schema if columns is None else pa.schema([schema.field(at) for at in sorted(set(columns))])
    batches = [pa.record_batch(batch) for batch in file.batches(columns, groups, rows)]
    assert all(batch.num_rows <= rows for batch in batches)
    return file, pa.Table.from_batches(batches, batches[0].schema if batches else chosen)


def compare(data: bytes, places: list[int], groups: list[int], rows: int) -> None:
    """All of the file, and some columns of some row groups."""
    theirs = pq.ParquetFile(io.BytesIO(data))
    groups = sorted({group % theirs.num_row_groups for group in groups}) if theirs.num_row_groups else []
    names = theirs.schema_arrow.names
    places = sorted({place % len(names) for place in places})
    file, whole = read(data, None, None, rows)
    assert whole.equals(theirs.read())
    assert pa.schema(file.schema).equals(theirs.schema_arrow, check_metadata=True)
    expected = theirs.read_row_groups(groups, [names[at] for at in places])
    assert read(data, places, groups, rows)[1].equals(expected)
    about = theirs.metadata
    assert [group.rows for group in file.footer.groups] == [
        about.row_group(k).num_rows for k in range(about.num_row_groups)
    ]
    for number in range(about.num_row_groups):
        for at, field in enumerate(theirs.schema_arrow):
            if field.type in PHYSICAL:
                stated = about.row_group(number).column(file.footer.columns[at].leaves.start).statistics
                found = file.footer.statistics(number, field.name)
                if stated is not None and stated.has_min_max and field.type != pa.float32():
                    assert (found.minimum, found.maximum) == (stated.min, stated.max)
                elif stated is None:
                    assert found == (None, None, None)
                if stated is not None and stated.has_null_count:
                    assert found.nulls == stated.null_count


LAYOUTS: dict[str, st.SearchStrategy[Any]] = {
    "compression": st.sampled_from(["zstd", "snappy", "gzip", "lz4", "none"]),
    "row_group_size": st.integers(20, 200),
    "data_page_size": st.sampled_from([64, 1 << 20]),
    "write_batch_size": st.just(16),
    "data_page_version": st.sampled_from(["1.0", "2.0"]),
    "use_dictionary": st.booleans(),
    "write_statistics": st.booleans(),
    "write_page_checksum": st.booleans(),
    "write_page_index": st.booleans(),
    "store_schema": st.booleans(),
}
PLACES = st.lists(st.integers(0, 5), min_size=1, max_size=3)


@settings(max_examples=80, deadline=None)
@given(table=tables(), layout=st.fixed_dictionaries(LAYOUTS), places=PLACES, groups=PLACES, rows=st.integers(1, 400))
def test_files_of_pyarrow_are_read_as_it_reads_them(table, layout, places, groups, rows):
    sink = io.BytesIO()
    pq.write_table(table, sink, **layout)
    compare(sink.getvalue(), places, groups, rows)


@settings(max_examples=15, deadline=None)
@given(
    table=tables(),
    codec=st.sampled_from(["zstd(1)", "snappy", "uncompressed", "lz4_raw"]),
    version=st.sampled_from(["parquet_1_0", "parquet_2_0"]),
    places=PLACES,
)
def test_files_of_arro3_are_read_as_pyarrow_reads_them(table, codec, version, places):
    sink = io.BytesIO()
    arrow_io.write_parquet(table, sink, compression=codec, max_row_group_size=100, writer_version=version)
    compare(sink.getvalue(), places, places, 1 << 16)


@pytest.mark.parametrize("codec", ["zstd", "snappy", "gzip", "uncompressed"])
@pytest.mark.parametrize("version", ["V1", "V2"])
def test_files_of_duckdb_are_read_as_pyarrow_reads_them(codec, version, tmp_path):
    path = tmp_path / "a.parquet"
    select = "range AS sample, range / 4000.0 AS time_s, range % 7 = 0 AS valid, [range, 1] AS l, 'w' || range % 3 AS s"
    duckdb.sql(
        f"COPY (SELECT {select}, CASE WHEN range % 5 > 0 THEN sin(range) END AS u FROM range(9000)) TO '{path}' "
        f"(FORMAT parquet, CODEC '{codec}', ROW_GROUP_SIZE 4096, PARQUET_VERSION {version})"
    )
    compare(path.read_bytes(), [1, 4, 5], [0, 2], 1 << 16)


def test_a_file_of_pandas_is_read_as_pyarrow_reads_it(tmp_path: Path):
    times = pd.date_range("2024-01-01", periods=500, freq="ms", name="time", tz="Europe/Vienna")
    values = {
        "u [V]": np.arange(500.0),
        "n": pd.array([1, None] * 250, "Int64"),
        "mode": pd.Categorical(["a", "b"] * 250),
    }
    pd.DataFrame(values, index=times).to_parquet(tmp_path / "a.parquet")
    path = tmp_path / "a.parquet"
    found, expected = (
        read(path.read_bytes(), [0, 2, 3], [0], 100)[1],
        pq.read_table(path, columns=["u [V]", "mode", "time"]),
    )
    assert found.to_pylist() == expected.to_pylist()  # PyArrow reads large_string as string
    assert found.schema.metadata == expected.schema.metadata
