"""Tables to and from all that speaks Arrow's PyCapsule interface, by nanoarrow: numbers go out without a copy."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.tables.arrow_ipc import buffers_of
from livebode.tables.table import KINDS, STRING, Column, Field, Schema, Table, Text

try:
    import nanoarrow as na
    from nanoarrow.c_schema import c_schema_view
except ModuleNotFoundError as error:
    message = "an exchange of tables needs nanoarrow, which is not installed; install livebode[parquet]"
    raise ModuleNotFoundError(message, name=error.name) from None

_TEXTS: dict[str, np.dtype[Any]] = {"string": np.dtype("int32"), "large_string": np.dtype("int64")}
"""Types of text with the type of their offsets."""
_NAMES = {"half_float": "float16", "float": "float32", "double": "float64"}
_VIEW, _SHORT = struct.Struct("<i4sii"), 12


def schema_to_arrow(schema: Schema) -> Any:
    """The schema with all metadata, as nanoarrow's."""
    columns = [
        na.c_schema(_types[field.kind]).modify(name=field.name, metadata=dict(field.metadata) or None)
        for field in schema
    ]
    return na.c_schema(na.struct([])).modify(children=columns, metadata=dict(schema.metadata) or None)


def to_arrow_stream(table: Table) -> Any:
    """The table as one batch of a stream of nanoarrow."""
    schema = schema_to_arrow(table.schema)
    children = [
        na.c_array_from_buffers(schema.child(index), len(column), [data or None for data in buffers_of(column)], 0)
        for index, column in enumerate(table.columns)
    ]
    batch = na.c_array_from_buffers(schema, table.num_rows, [None], 0, children=children)
    return na.c_array_stream(batch)


def from_arrow(data: Any) -> Table:
    """See `Table.from_arrow`."""
    with na.c_array_stream(data) as stream:
        schema = stream.get_schema()
        if schema.format != "+s":
            raise TypeError(f"the data are of type {schema.format!r} of Arrow, not a table")
        columns = list(schema.children)
        kinds = [kind_of(column) for column in columns]
        batches = list(stream)
    parts = [
        [_values(batch.child(index), kind, batch.offset, batch.length) for batch in batches]
        for index, kind in enumerate(kinds)
    ]
    joined = tuple(_joined(part, kind) for part, kind in zip(parts, kinds))
    fields = tuple(  # integers with nulls are doubles now
        Field(column.name, STRING if isinstance(values, Text) else values.dtype.name, _texts(column.metadata))
        for column, values in zip(columns, joined)
    )
    return Table(Schema(fields, _texts(schema.metadata)), joined)


def kind_of(column: Any) -> str:
    """The kind of a column of this schema; TypeError if it contains neither numbers, truth values nor text."""
    view = c_schema_view(column if column.dictionary is None else column.dictionary)
    if view.type in _TEXTS or view.type == "string_view":
        return STRING
    kind: str = _NAMES.get(view.type, view.type)
    if kind not in KINDS:
        raise TypeError(f"column {column.name!r} is of type {kind}")
    return kind


def _values(array: Any, kind: str, begin: int, count: int) -> Column:
    """So many values of an array from this one on, nulls as in `Table.from_arrow`."""
    view = array.view()
    rows = slice(begin + array.offset, begin + array.offset + count)
    valid = _bits(view.buffer(0), rows) if array.null_count and view.buffer(0).size_bytes else None
    if view.dictionary is not None:
        codes = np.frombuffer(view.buffer(1), np.dtype(view.storage_type))[rows]
        entries = _values(array.dictionary, kind, 0, array.dictionary.length)
        if isinstance(entries, Text):
            return Text.of([*entries, ""], codes if valid is None else np.where(valid, codes, len(entries)))
        return _with_nan(entries[codes if valid is None else np.where(valid, codes, 0)], valid)
    if kind == STRING:
        words = _words(view, rows)
        return Text.of(words if valid is None else [word if known else "" for word, known in zip(words, valid)])
    if kind == "bool":
        return _with_nan(_bits(view.buffer(1), rows), valid)
    return _with_nan(np.frombuffer(view.buffer(1), kind)[rows], valid)


def _words(view: Any, rows: slice) -> list[str]:
    if view.storage_type not in _TEXTS:
        return _viewed(view, rows)
    ends = np.frombuffer(view.buffer(1), _TEXTS[view.storage_type])[rows.start : rows.stop + 1].tolist()
    letters = bytes(view.buffer(2))
    return [letters[begin:end].decode() for begin, end in pairwise(ends)]


def _viewed(view: Any, rows: slice) -> list[str]:
    """Text in views: short words are in them, others in one of several buffers."""
    letters = [bytes(buffer) for buffer in list(view.buffers)[2:]]
    words = []
    for word in np.frombuffer(view.buffer(1), "V16")[rows].tolist():
        size, _, number, begin = _VIEW.unpack(word)
        words.append((word[4 : 4 + size] if size <= _SHORT else letters[number][begin : begin + size]).decode())
    return words


def _bits(buffer: Any, rows: slice) -> NDArray[np.bool_]:
    return np.unpackbits(np.frombuffer(buffer, np.uint8), bitorder="little").view(np.bool_)[rows]


def _with_nan(values: NDArray[Any], valid: NDArray[np.bool_] | None) -> NDArray[Any]:
    if valid is None:
        return values
    return values & valid if values.dtype == np.bool_ else np.where(valid, values, np.nan)


def _joined(parts: list[Column], kind: str) -> Column:
    if kind == STRING:
        return Text.join([part for part in parts if isinstance(part, Text)])
    numbers = [part for part in parts if not isinstance(part, Text)]
    if not numbers:
        return np.empty(0, kind)
    return np.concatenate(numbers) if numbers[1:] else numbers[0]


def _texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    pairs = {} if metadata is None else dict(metadata.items())
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in pairs.items()}


_types = {kind: getattr(na, "bool_" if kind == "bool" else kind)() for kind in KINDS}
