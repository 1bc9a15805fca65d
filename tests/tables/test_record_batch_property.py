"""Rows of a journal as messages: the bytes of PyArrow, the same rows again, and no damage does more than an error."""

from __future__ import annotations

import contextlib
import struct
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from livebode.tables import Table, Text, from_message, schema_from_message, schema_to_message, to_message

KINDS = ["float64", "int64", "bool", "float32", "uint8", "int16", "string"]


@st.composite
def tables(draw: st.DrawFn, rows_min: int = 0) -> Table:
    rows = draw(st.integers(rows_min, 40))
    columns: dict[str, Any] = {}
    for number, kind in enumerate(draw(st.lists(st.sampled_from(KINDS), min_size=1, max_size=6))):
        if kind == "string":
            words = draw(st.lists(st.text(max_size=9), min_size=1, max_size=4))
            at = draw(hnp.arrays(np.int32, rows, elements=st.integers(0, len(words) - 1)))
            columns[f"c{number}"] = Text.of(words, at)
        else:
            columns[f"c{number}"] = draw(hnp.arrays(np.dtype(kind), rows))
    return Table.of(columns)


def as_written_by_pyarrow(table: Table) -> bytes:
    arrays = [pa.array(c.to_list(), pa.string()) if isinstance(c, Text) else pa.array(c) for c in table.columns]
    return bytes(pa.record_batch(arrays, schema=pa.schema(table)).serialize().to_pybytes())


@given(tables(rows_min=1))
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_the_bytes_are_those_of_pyarrow(table: Table) -> None:
    assert to_message(table) == as_written_by_pyarrow(table)


@given(tables())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_rows_come_back_from_any_place_in_memory(table: Table) -> None:
    message = to_message(table)
    for shift in (0, 3):
        assert from_message(memoryview(bytes(shift) + message)[shift:], table.schema).equals(table)


@given(tables(rows_min=1), st.data())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_a_damaged_message_is_an_error_or_no_more_than_its_bytes(table: Table, data: st.DataObject) -> None:
    message = bytearray(to_message(table))
    for _ in range(data.draw(st.integers(1, 4))):
        message[data.draw(st.integers(0, len(message) - 1))] = data.draw(st.integers(0, 255))
    with contextlib.suppress(ValueError, struct.error):
        found = from_message(memoryview(bytes(message)), table.schema)
        assert found.num_rows <= 8 * len(message)


def test_a_message_of_old_arrow_without_a_mark_is_read() -> None:
    table = Table.of({"sample": np.arange(5)})
    options = pa.ipc.IpcWriteOptions(use_legacy_format=True)
    batch = pa.record_batch(pa.table(table).to_batches()[0])
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema, options=options) as stream:
        stream.write_batch(batch)
    begin = pa.ipc.read_message(sink.getvalue()).metadata.size + 4
    assert from_message(memoryview(sink.getvalue())[begin:], table.schema).equals(table)


@pytest.mark.parametrize("what", ["compressed", "null", "shared", "other columns"])
def test_a_message_that_no_run_writes_is_refused(what: str) -> None:
    schema = Table.of({"a": np.zeros(100), "b": np.zeros(100)}).schema
    column = pa.array(np.zeros(100))
    if what == "compressed":
        message = _compressed(pa.record_batch([column, column], ["a", "b"]))
    elif what == "null":
        message = _bytes(pa.record_batch([pa.array([None, 1.0] * 50), column], ["a", "b"]))
    elif what == "shared":
        message = _sharing(_bytes(pa.record_batch([column, column], ["a", "b"])))
    else:
        message = _bytes(pa.record_batch([column], ["a"]))
    with pytest.raises(ValueError, match=r"compressed|nulls|expand|differ"):
        from_message(memoryview(message), schema)


def _bytes(batch: pa.RecordBatch) -> bytes:
    return bytes(batch.serialize().to_pybytes())


def _compressed(batch: pa.RecordBatch) -> bytes:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema, options=pa.ipc.IpcWriteOptions(compression="zstd")) as stream:
        stream.write_batch(batch)
    begin = batch.schema.serialize().size
    return bytes(sink.getvalue())[begin:]


def _sharing(message: bytes) -> bytes:
    """Both columns refer to the bytes of the first, of which half is left."""
    places = [struct.pack("<qq", start, 800) for start in (0, 800)]
    body = len(message) - 1600
    before, _, after = message[:body].rpartition(places[1])
    return before + places[0] + after + message[body : body + 800]


@given(tables())
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_a_schema_comes_back_also_from_pyarrow(table: Table) -> None:
    assert schema_from_message(schema_to_message(table.schema)) == table.schema
    assert schema_from_message(pa.schema(table).serialize().to_pybytes()) == table.schema
    assert pa.ipc.read_schema(pa.py_buffer(schema_to_message(table.schema))) == pa.schema(table)
