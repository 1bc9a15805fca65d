"""Parquet files that are written group by group: every reader finds the rows, the groups and what they are about."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.tables import Field, ParquetFile, ParquetWriter, Schema, Table, Text
from livebode.tables.parquet_format import FORMS
from livebode.tables.thrift_compact import decode

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
@settings(max_examples=25, deadline=None)
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
    assert [group.column(k).compression for k in range(4)] == ["LZ4", "UNCOMPRESSED", "LZ4", "LZ4"]


def test_duckdb_reads_a_part_by_its_statistics(tmp_path: Path) -> None:
    import duckdb

    (tmp_path / "a.parquet").write_bytes(written([50, 70, 1]))
    with duckdb.connect() as database:
        found = database.execute(
            f"select count(*), min(sample), max(name) from '{tmp_path}/a.parquet' where sample >= 50"
        ).fetchone()
    assert found == (71, 50, "δ")


def test_another_schema_is_refused() -> None:
    with pytest.raises(ValueError, match="another schema"):
        ParquetWriter(io.BytesIO(), SCHEMA).write(Table.of({"a": np.zeros(2)}))


@st.composite
def columns(draw: st.DrawFn) -> Table:
    """Every kind of column, with runs, periods, few or many values, extremes and NaN of every sign."""
    rng, rows = np.random.default_rng(draw(st.integers(0, 99))), draw(st.integers(1, 500))
    shapes = draw(st.lists(st.sampled_from(["runs", "periods", "few", "all"]), min_size=12, max_size=12))
    found = {}
    for kind, shape in zip([kind for kind in FORMS if kind != "string"], shapes):
        few = rng.integers(0, 256, (9, 8), dtype=np.uint8).view(kind if kind != "bool" else np.uint8)[:, 0]
        few = few % 2 == 0 if kind == "bool" else few
        at = {"runs": np.arange(rows) // 40 % 9, "periods": np.arange(rows) % 9, "few": rng.integers(0, 9, rows)}
        found[kind] = few[at[shape]] if shape != "all" else rng.permutation(np.arange(rows)).astype(kind)
    words = draw(st.lists(st.text(max_size=5), min_size=1, max_size=5))
    return Table.of({**found, "string": Text.of(words, rng.integers(0, len(words), rows))})


@given(columns(), st.booleans())
@settings(max_examples=60, deadline=None)
def test_every_kind_of_column_is_read_by_pyarrow_and_by_livebode(table: Table, repeating: bool) -> None:
    sink = io.BytesIO()
    writer = ParquetWriter(sink, table.schema, table.column_names if repeating else [])
    writer.write(table)
    writer.close()
    ours = ParquetFile(sink.getvalue()).table()
    theirs = pq.read_table(pa.BufferReader(sink.getvalue()))
    assert ours.equals(table)
    assert Table.from_arrow(theirs).equals(table)
    for name in set(table.column_names) - {"string"}:
        assert ours[name].tobytes() == table[name].tobytes()
        assert theirs[name].to_numpy().tobytes() == table[name].tobytes()


def test_a_long_column_has_several_pages(tmp_path: Path) -> None:
    import duckdb

    number = np.arange(300_000)
    table = Table.of(
        {"all": np.sin(number), "few": number // 1000, "true": number % 7 > 0, "s": Text.of("ab", number % 2)}
    )
    sink = io.BytesIO()
    writer = ParquetWriter(sink, table.schema, ["few"])
    writer.write(table)
    writer.close()
    assert ParquetFile(sink.getvalue()).table().equals(table)
    (tmp_path / "a.parquet").write_bytes(sink.getvalue())
    with duckdb.connect() as database:
        found = database.execute(
            f'select sum("few"), sum("true"::int), count(distinct s) from \'{tmp_path}/a.parquet\''
        )
        assert found.fetchone() == (int(table["few"].sum()), int(table["true"].sum()), 2)


def test_bounds_leave_out_what_is_not_a_number() -> None:
    table = Table.of(
        {"u": np.array([np.nan, -2.0, 3.0]), "nan": np.full(3, np.nan), "zero": np.array([0.0, -0.0, 0.0])}
    )
    sink = io.BytesIO()
    writer = ParquetWriter(sink, table.schema)
    writer.write(table)
    writer.close()
    group = pq.ParquetFile(pa.BufferReader(sink.getvalue())).metadata.row_group(0)
    stated = [group.column(k).statistics for k in range(3)]
    assert (stated[0].min, stated[0].max, stated[1].has_min_max) == (-2.0, 3.0, False)
    assert (np.signbit(stated[2].min), np.signbit(stated[2].max)) == (True, False)


def test_half_precision_is_refused() -> None:
    with pytest.raises(TypeError, match="'h' is of half precision"):
        ParquetWriter(io.BytesIO(), Schema.of(h="float16"))


@given(st.binary(max_size=60), st.integers(0, 2000))
@settings(max_examples=150, deadline=None)
def test_damaged_thrift_is_a_value_error(noise: bytes, at: int) -> None:
    data = written([3])[-1500:-8]
    for damaged in (noise, data[: at % len(data)] + noise + data[at % len(data) :]):
        try:
            decode(damaged)
        except ValueError:
            continue
