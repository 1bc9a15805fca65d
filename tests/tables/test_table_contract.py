"""The house's table: what it is, and that others read it and it reads theirs."""

from __future__ import annotations

import sys

import numpy as np
import pyarrow as pa
import pytest

from livebode.tables import Field, Schema, Table, Text

UNITS = Schema(
    (
        Field("sample", "int64"),
        Field("u", "float64", {"unit": "N·m"}),
        Field("ready", "bool"),
        Field("model", "string"),
    ),
    {"rate_hz": "4000"},
)


def example(rows: int = 5) -> Table:
    number = np.arange(rows)
    return Table(
        UNITS, (number, np.where(number == 1, np.nan, number / 3), number > 2, Text.of(["a", "ü"], number % 2))
    )


def test_pyarrow_takes_values_metadata_and_all_kinds_and_gives_them_back() -> None:
    table = example()
    arrow = pa.table(table)
    assert arrow.schema.field("u").metadata == {b"unit": "N·m".encode()}
    assert arrow.schema.metadata == {b"rate_hz": b"4000"}
    assert arrow["model"].to_pylist() == ["a", "ü", "a", "ü", "a"]
    assert Table.from_arrow(arrow).equals(table)
    assert pa.table(Table.empty(UNITS)).schema == arrow.schema
    assert pa.schema(UNITS) == arrow.schema


def test_numbers_are_not_copied_for_pyarrow() -> None:
    values = np.arange(1000.0)
    assert pa.table(Table.of({"a": values}))["a"].chunk(0).buffers()[1].address == values.ctypes.data


def test_duckdb_reads_it() -> None:
    import duckdb

    with duckdb.connect() as database:
        database.register("example", example())
        rows = database.execute("select model, count(*) from example group by model order by model").fetchall()
    assert rows == [("a", 3), ("ü", 2)]


def test_chunks_dictionaries_and_nulls_of_others_are_read() -> None:
    chunks = pa.chunked_array([pa.array([1, None]), pa.array([3])])
    words = pa.chunked_array([pa.array(["b", None]).dictionary_encode(), pa.array(["a"]).dictionary_encode()])
    truth = pa.array([True, None, False])
    found = Table.from_arrow(pa.table({"n": chunks, "s": words, "b": truth, "large": words.cast(pa.large_string())}))
    np.testing.assert_array_equal(found["n"], [1, np.nan, 3])
    assert found.text("s").to_list() == found.text("large").to_list() == ["b", "", "a"]
    assert found["b"].tolist() == [True, False, False]


def test_a_slice_of_pyarrow_with_nulls_is_read_from_its_first_row() -> None:
    sliced = pa.table({"n": pa.array([1.0, None, 3.0, None, 5.0])}).slice(1, 3)
    np.testing.assert_array_equal(Table.from_arrow(sliced)["n"], [np.nan, 3, np.nan])


def test_joined_parts_are_the_whole() -> None:
    table = example(9)
    assert Table.join([table.slice(0, 2), table.slice(2, 0), table.slice(2)]).equals(table)
    with pytest.raises(ValueError, match="different columns"):
        Table.join([table, table.select(["u"])])


def test_rows_are_selected_and_compared() -> None:
    table = example()
    assert table.select(["model", "u"]).column_names == ["model", "u"]
    assert table.text("model").where("ü").tolist() == [False, True, False, True, False]
    assert not table.text("model").where("no such word").any()
    assert not table.equals(example(4))
    assert not table.equals(table.select(["sample"]))


def test_a_misfit_of_columns_and_schema_is_an_error() -> None:
    with pytest.raises(ValueError, match="'sample' is not of type int64"):
        Table(UNITS, (np.arange(2.0), np.arange(2.0), np.ones(2, bool), Text.of(["a", "b"])))
    with pytest.raises(ValueError, match="differ in length"):
        Table.of({"a": np.arange(2), "b": np.arange(3)})
    with pytest.raises(TypeError, match="'t' is of type date32"):
        Field("t", "date32")
    with pytest.raises(TypeError, match="of type timestamp"):
        Table.from_arrow(pa.table({"t": pa.array([0], pa.timestamp("ns"))}))
    with pytest.raises(TypeError, match="is text"):
        example()["model"]
    with pytest.raises(TypeError, match="is not text"):
        example().text("u")
    with pytest.raises(KeyError, match="missing"):
        example()["missing"]


def test_without_nanoarrow_an_exchange_names_the_extra_that_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    arrow = pa.table({"t": [0.5]})
    monkeypatch.setitem(sys.modules, "nanoarrow", None)
    monkeypatch.delitem(sys.modules, "livebode.tables.exchange", raising=False)
    with pytest.raises(ModuleNotFoundError, match=r"nanoarrow, which is not installed.*livebode\[parquet\]"):
        Table.from_arrow(arrow)
