"""Tables to and from arro3, which speaks Arrow's PyCapsule interface: numbers go out without a copy."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from arro3 import core
from arro3 import io as arrow_io
from arro3.core import DataType
from numpy.typing import NDArray

from livebode.tables.record_batch import messages, nullable_columns
from livebode.tables.schema import KINDS, STRING, Field, Schema
from livebode.tables.table import Column, Table
from livebode.tables.text import Text

_END_OF_STREAM = b"\xff\xff\xff\xff\0\0\0\0"


def schema_to_arrow(schema: Schema) -> core.Schema:
    """The schema with all metadata."""
    fields = [
        core.Field(field.name, _types[field.kind], nullable=True, metadata=dict(field.metadata) or None)
        for field in schema
    ]
    return core.Schema(fields, metadata=dict(schema.metadata) or None)


def schema_from_arrow(data: Any) -> Schema:
    """Of what has a schema; TypeError if a column contains neither numbers, truth values nor text."""
    found = core.Schema.from_arrow(data)
    fields = [found.field(at) for at in range(len(found))]
    kinds = [Field(one.name, kind_of(one.type), _texts(one.metadata)) for one in fields]
    return Schema(tuple(kinds), _texts(found.metadata))


def schema_to_message(schema: Schema) -> bytes:
    """The schema as a message of Arrow IPC."""
    return bytes(next(messages(memoryview(_stream_of(core.Table.from_batches([], schema=schema_to_arrow(schema)))))))


def schema_from_message(message: bytes) -> Schema:
    """Inverse of `schema_to_message`, also of those that others wrote.

    Raises
    ------
    ValueError
        If it cannot be read.
    TypeError
        If a column contains neither numbers, truth values nor text.
    """
    try:
        found = arrow_io.read_ipc_stream(io.BytesIO(message + _END_OF_STREAM)).schema
    except Exception as error:
        raise ValueError(f"it is not a schema of Arrow ({error})") from None
    return schema_from_arrow(found)


def to_arrow(table: Table) -> core.Table:
    """The table, for all functions of arro3."""
    return core.Table.from_batches([_batch_of(table)], schema=schema_to_arrow(table.schema))


def to_arrow_stream(schema: Schema, tables: Iterable[Table]) -> core.RecordBatchReader:
    """The tables as record batches of one stream; each is requested when the one before it was read."""
    return core.RecordBatchReader.from_batches(schema_to_arrow(schema), (_batch_of(table) for table in tables))


def from_arrow(data: Any) -> Table:
    """See `Table.from_arrow`."""
    table = core.Table.from_arrow(data)
    stated = schema_from_arrow(table.schema)
    columns = tuple(numpy_of(table.column(at)) for at in range(table.num_columns))
    fields = tuple(  # integers with nulls are doubles now
        Field(field.name, field.kind if isinstance(column, Text) else column.dtype.name, field.metadata)
        for field, column in zip(stated, columns)
    )
    return Table(Schema(fields, stated.metadata), columns)


def numpy_of(column: core.ChunkedArray) -> Column:
    """The values of a column; nulls as in `Table.from_arrow`. TypeError as there."""
    kind = kind_of(column.type)
    if kind == STRING:
        return Text.join([_words_of(chunk) for chunk in column.chunks])
    if DataType.is_dictionary(column.type):
        column = column.cast(_types[kind])
    parts = [_with_nan(chunk, kind) if chunk.null_count else chunk.to_numpy() for chunk in column.chunks]
    if not parts:
        return np.empty(0, kind)
    values: NDArray[Any] = np.concatenate(parts) if parts[1:] else parts[0]
    return values


def kind_of(arrow_type: DataType) -> str:
    """The kind of a column of this type; TypeError if it contains neither numbers, truth values nor text."""
    kind = arrow_type.value_type if DataType.is_dictionary(arrow_type) else arrow_type
    if kind in _TEXTS:
        return STRING
    for name, one in _types.items():
        if one == kind:
            return name
    raise TypeError(f"a column is of type {arrow_type}")


def _batch_of(table: Table) -> core.RecordBatch:
    arrays = [_array_of(column) for column in table.columns]
    return core.RecordBatch.from_arrays(arrays, schema=schema_to_arrow(table.schema))


def _array_of(column: Column) -> core.Array:
    if isinstance(column, Text):
        words = core.Array(list(column.words), DataType.string())
        return words.take(core.Array.from_numpy(np.ascontiguousarray(column.at)))
    return core.Array.from_numpy(np.ascontiguousarray(column))


def _words_of(chunk: core.Array) -> Text:
    coded = chunk.cast(_CODED)
    words: list[str] = list(core.dictionary_dictionary(coded).to_pylist())
    codes = core.dictionary_indices(coded)
    if not chunk.null_count:
        return Text.of(words, codes.to_numpy())
    at = _with_nan(codes, "int32")
    return Text.of([*words, ""], np.where(np.isnan(at), len(words), at).astype(np.int32))


def _with_nan(chunk: core.Array, kind: str) -> NDArray[Any]:
    """The values with NaN for null, or False; arro3 gives out its bits of nulls in a stream only."""
    batch = core.RecordBatch.from_arrays([chunk], names=["x"])
    message = list(messages(memoryview(_stream_of(batch))))[-1]
    ((values, valid),) = nullable_columns(message, [kind])
    assert not isinstance(values, Text)
    if valid is None:
        return values
    return values & valid if kind == "bool" else np.where(valid, values, np.nan)


def _stream_of(data: core.Table | core.RecordBatch) -> bytes:
    sink = io.BytesIO()
    arrow_io.write_ipc_stream(data, sink, compression=None)
    return sink.getvalue()


def _texts(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in metadata.items()}


_types = {kind: getattr(DataType, kind)() for kind in KINDS}
_TEXTS = DataType.string(), DataType.large_string(), DataType.string_view()
_CODED = DataType.dictionary(DataType.int32(), DataType.string())
