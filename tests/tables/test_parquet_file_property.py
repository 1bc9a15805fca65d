"""Parquet files of earlier runs and of others, in every layout: the rows, schema and statistics that PyArrow reads."""

from __future__ import annotations

import io
import sys
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.tables import ParquetFile, Table

KINDS = [
    pa.float64(), pa.float32(), pa.int64(), pa.int32(), pa.int16(), pa.uint8(), pa.uint64(), pa.bool_(), pa.string(),
    pa.dictionary(pa.int32(), pa.string()),
]  # fmt: skip
PHYSICAL = pa.float64(), pa.float32(), pa.int64(), pa.int32()


def column(kind: pa.DataType, rows: int, rng: np.random.Generator, nulls: bool) -> pa.Array[Any]:
    """Values of this type in runs of different length, and nulls among them."""
    if pa.types.is_dictionary(kind):
        return column(kind.value_type, rows, rng, nulls).dictionary_encode()
    values: list[Any]
    if pa.types.is_floating(kind):
        values = list(rng.choice([*rng.standard_normal(40), -0.0, np.inf], rows))
    elif pa.types.is_string(kind):
        values = [f"µ{k % 5}" for k in range(rows)]
    elif pa.types.is_boolean(kind):
        values = [bool(one) for one in rng.random(rows) > 0.5]
    else:
        values = [int(one) for one in np.repeat(rng.integers(0, 100, rows), rng.integers(1, 20, rows))[:rows]]
    return pa.array([None if nulls and rng.random() < 0.3 else one for one in values], kind)


@st.composite
def tables(draw: st.DrawFn) -> pa.Table:
    kinds = draw(st.lists(st.sampled_from(KINDS), min_size=1, max_size=6))
    rows, nulls = draw(st.integers(0, 300)), draw(st.booleans())
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    fields = [pa.field(f"c{at}", kind, metadata={"unit": "V"} if at % 2 else None) for at, kind in enumerate(kinds)]
    schema = pa.schema(fields, {"rate_hz": "4000"} if draw(st.booleans()) else None)
    return pa.table([column(kind, rows, rng, nulls) for kind in kinds], schema=schema)


def compare(data: bytes, places: list[int], groups: list[int], rows: int) -> None:
    """All of the file, and some columns of some row groups."""
    theirs, ours = pq.ParquetFile(io.BytesIO(data)), ParquetFile(data)
    groups = sorted({group % theirs.num_row_groups for group in groups}) if theirs.num_row_groups else []
    names = theirs.schema_arrow.names
    names = [names[place] for place in sorted({place % len(names) for place in places})]
    assert ours.table().equals(Table.from_arrow(theirs.read()))
    assert ours.table(groups, names).equals(Table.from_arrow(theirs.read_row_groups(groups, names)))
    parts = list(ParquetFile(io.BytesIO(data)).tables(rows))
    assert all(0 < part.num_rows <= rows for part in parts)
    assert sum(part.num_rows for part in parts) == theirs.metadata.num_rows
    for number in range(theirs.num_row_groups):
        group = theirs.metadata.row_group(number)
        assert ours.footer.groups[number].rows == group.num_rows
        for at, field in enumerate(theirs.schema_arrow):
            if field.type in PHYSICAL:
                stated = group.column(at).statistics
                found = ours.footer.statistics(number, field.name)
                assert found.nulls == (None if stated is None else stated.null_count)
                if stated is None:
                    assert found == (None, None, None)
                elif stated.has_min_max:
                    assert (found.minimum, found.maximum) == (stated.min, stated.max)


LAYOUTS: dict[str, st.SearchStrategy[Any]] = {
    "compression": st.sampled_from(["lz4", "none"]),
    "row_group_size": st.integers(20, 200),
    "data_page_size": st.sampled_from([64, 1 << 20]),
    "write_batch_size": st.just(16),
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


def test_categories_may_be_more_than_the_rows_of_a_group():
    words = pa.array([f"µ{n}" for n in range(5)])
    table = pa.table({"a": pa.DictionaryArray.from_arrays(pa.array(np.resize(np.arange(5), 33)), words)})
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="lz4", row_group_size=30)
    compare(sink.getvalue(), [0], [0, 1], 33)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 20), st.lists(st.tuples(st.integers(0, 1 << 20), st.integers(1, 60)), min_size=1, max_size=40))
def test_dictionaries_of_any_size_with_runs_of_any_length_are_read(width, runs):
    values = np.repeat([value % (1 << width) for value, _ in runs], [count for _, count in runs])
    words = np.arange(1 << width)
    sink = io.BytesIO()  # all words come first, so that their numbers have this width
    pq.write_table(
        pa.table({"a": np.concatenate([words, values])}), sink, compression="lz4", dictionary_pagesize_limit=1 << 30
    )
    np.testing.assert_array_equal(ParquetFile(sink.getvalue()).table()["a"][len(words) :], values)


def test_a_file_of_duckdb_is_read_as_pyarrow_reads_it(tmp_path):
    import duckdb

    path = tmp_path / "a.parquet"
    select = "range AS sample, range / 4000.0 AS time_s, range % 7 = 0 AS valid, 'w' || range % 3 AS s"
    duckdb.sql(
        f"COPY (SELECT {select}, CASE WHEN range % 5 > 0 THEN sin(range) END AS u FROM range(9000)) TO '{path}' "
        "(FORMAT parquet, CODEC 'lz4_raw', ROW_GROUP_SIZE 4096, PARQUET_VERSION V1)"
    )
    compare(path.read_bytes(), [1, 4], [0, 2], 1 << 16)


FOREIGN = {
    "Zstandard": {"compression": "zstd"},
    "kind 3": {"data_page_version": "2.0", "compression": "lz4"},
    "encoding 9": {"column_encoding": "BYTE_STREAM_SPLIT", "use_dictionary": False, "compression": "none"},
}


@pytest.mark.parametrize("form", FOREIGN)
def test_a_form_that_no_run_writes_is_read_by_pyarrow_and_named_without_it(form, monkeypatch):
    sink, values = io.BytesIO(), np.arange(9.0)
    pq.write_table(pa.table({"a": values}), sink, row_group_size=4, **FOREIGN[form])
    for content in (sink.getvalue(), sink):
        np.testing.assert_array_equal(ParquetFile(content).table([1, 2])["a"], values[4:])
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ValueError, match=rf"{form}, which needs PyArrow: install livebode\[parquet\]"):
        ParquetFile(sink.getvalue()).table()


@pytest.mark.parametrize("kind", [pa.timestamp("us"), pa.decimal128(9, 2), pa.list_(pa.float64()), pa.binary()])
def test_a_column_of_another_type_is_named_and_the_others_are_read(kind):
    sink = io.BytesIO()
    pq.write_table(pa.table({"a": np.arange(2), "t": pa.array([None, None], kind), "z": [0.5, 1.5]}), sink)
    with pytest.raises(TypeError, match="'t' is of a type"):
        ParquetFile(sink.getvalue()).table()
    sink = io.BytesIO()
    pq.write_table(pa.table({"t": pa.array([None], kind), "z": [0.5]}), sink, compression="none")
    assert ParquetFile(sink.getvalue()).table(columns=["z"])["z"].tolist() == [0.5]
