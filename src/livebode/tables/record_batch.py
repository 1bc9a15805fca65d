"""A table as one record batch message of Arrow IPC: the form of the rows in a journal.

The metadata that are written are a FlatBuffers table of one fixed layout: byte by byte that of Arrow's C++. Messages of
other writers are read as well. A message is untrusted data: what is read from it is never larger than the message.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.tables.flat_buffers import field as field_at
from livebode.tables.flat_buffers import number_at, referred, root
from livebode.tables.schema import STRING, Schema
from livebode.tables.table import Column, Table
from livebode.tables.text import Text

_PREFIX = struct.Struct("<II")
_CONTINUES = 0xFFFFFFFF
# Message and RecordBatch of Arrow's Message.fbs: root, layout and fields of both, and the number of buffers.
_HEAD = struct.Struct("<I4x6HiBBHIq2x5HiIIq4xI")
_MESSAGE = 20, 12, 22, 6, 5, 8, 12, 12, 0, 3, 4, 24
_BATCH = 10, 24, 12, 4, 8, 10
_TO_BUFFERS, _TO_NODES = 16, 28  # from the places of these offsets; the nodes are after the buffers
_HEADER_TYPE, _HEADER = 1, 2  # numbers of the fields of Message, and below of RecordBatch
_ROWS, _NODES, _BUFFERS, _COMPRESSION = 0, 1, 2, 3
_RECORD_BATCH = 3


class _Buffer(NamedTuple):
    start: int
    length: int


def to_message(table: Table) -> bytes:
    """The rows; the schema is not among them."""
    buffers = [data for column in table.columns for data in buffers_of(column)]
    starts = list(accumulate((len(data) + -len(data) % 8 for data in buffers), initial=0))
    places = [number for start, data in zip(starts, buffers) for number in (start, len(data))]
    nodes = [table.num_rows, 0] * len(table.columns)
    head = _HEAD.pack(
        *_MESSAGE, starts[-1], *_BATCH, _TO_NODES + 8 * len(places), _TO_BUFFERS, table.num_rows, len(buffers)
    )
    metadata = b"".join(
        [head, struct.pack(f"<{len(places)}q4xI{len(nodes)}q", *places, len(table.columns), *nodes)]
    )  # fmt: skip
    body = [part for data in buffers for part in (data, bytes(-len(data) % 8))]
    return b"".join([_PREFIX.pack(_CONTINUES, len(metadata)), metadata, *body])


def from_message(payload: memoryview, schema: Schema) -> Table:
    """The rows in these bytes; numbers without a copy if they are aligned.

    Raises
    ------
    ValueError, struct.error
        If the bytes are not such a message, are compressed, contain nulls, or several columns refer to the same bytes:
        they could expand to any size.
    """
    metadata, body = _split(payload)
    message = root(metadata)
    header_type = number_at("B", metadata, message, _HEADER_TYPE)
    header = referred(metadata, message, _HEADER)
    if header_type != _RECORD_BATCH or header is None:
        raise ValueError("it is not a record batch")
    if field_at(metadata, header, _COMPRESSION) is not None:
        raise ValueError("compressed rows")
    rows = number_at("q", metadata, header, _ROWS)
    nodes, pairs = _pairs(metadata, header, _NODES), _pairs(metadata, header, _BUFFERS)
    buffers = [_Buffer(start, length) for start, length in pairs]
    if rows < 0 or len(nodes) != len(schema) or any(length != rows for length, _ in nodes):
        raise ValueError("its columns differ from its schema")
    if any(min(one) < 0 for one in buffers) or sum(one.length for one in buffers) > len(payload):
        raise ValueError(f"{len(payload)} bytes expand to more")
    if len(buffers) != sum(3 if field.kind == STRING else 2 for field in schema):
        raise ValueError("its buffers differ from its schema")
    if any(nulls for _, nulls in nodes):
        raise ValueError("the rows contain nulls")
    each = iter(buffers)
    columns: list[Column] = []
    for kind in (field.kind for field in schema):
        next(each)  # bits of nulls
        columns.append(
            _text(body, next(each), next(each), rows) if kind == STRING else _numbers(body, next(each), kind, rows)
        )
    return Table(schema, tuple(columns))


def buffers_of(column: Column) -> Iterator[bytes | memoryview]:
    """Arrow's buffers of a column, of which the first, the bits of nulls, is empty."""
    yield b""
    if isinstance(column, Text):
        letters = [word.encode() for word in column.words]
        lengths = np.array([0, *map(len, letters)], dtype=np.int32)
        yield np.cumsum(lengths[np.concatenate([[0], column.at + 1])], dtype=np.int32).tobytes()
        yield b"".join([letters[number] for number in column.at.tolist()])
    elif column.dtype == np.bool_:
        yield np.packbits(column, bitorder="little").tobytes()
    else:
        yield np.ascontiguousarray(column).view(np.uint8).data


def _numbers(body: memoryview, buffer: _Buffer, kind: str, rows: int) -> NDArray[Any]:
    if kind == "bool":
        return _bits(body, buffer, rows)
    dtype = np.dtype(kind)
    if buffer.length < rows * dtype.itemsize:
        raise ValueError("a column is too short")
    return np.require(np.frombuffer(body, dtype, rows, buffer.start) if rows else np.empty(0, dtype), requirements="A")


def _bits(body: memoryview, buffer: _Buffer, rows: int) -> NDArray[np.bool_]:
    packed = _numbers(body, buffer, "uint8", -(-rows // 8))
    return np.unpackbits(packed, count=rows, bitorder="little").view(np.bool_)


def _text(body: memoryview, ends: _Buffer, letters: _Buffer, rows: int) -> Text:
    if not rows:
        return Text((), np.empty(0, np.int32))
    offsets = _numbers(body, ends, "int32", rows + 1)
    data = _numbers(body, letters, "uint8", letters.length).tobytes()
    if offsets[0] < 0 or offsets[-1] > len(data) or (np.diff(offsets) < 0).any():
        raise ValueError("a column of text has invalid offsets")
    numbers: dict[bytes, int] = {}
    at = [numbers.setdefault(data[begin:end], len(numbers)) for begin, end in pairwise(offsets.tolist())]
    return Text(tuple(word.decode() for word in numbers), np.array(at, dtype=np.int32))


def _split(payload: memoryview) -> tuple[bytes, memoryview]:
    """The metadata and the body; messages from before Arrow 0.15 have no mark in front of their length."""
    mark, length = _PREFIX.unpack_from(payload)
    begin = _PREFIX.size
    if mark != _CONTINUES:
        begin, length = begin - 4, mark
    if begin + length > len(payload):
        raise ValueError("the message is cut")
    return bytes(payload[begin : begin + length]), payload[begin + length :]


def _pairs(data: bytes, table: int, number: int) -> list[tuple[int, int]]:
    """A vector of two numbers each."""
    place = referred(data, table, number)
    if place is None:
        return []
    (count,) = struct.unpack_from("<I", data, place)
    if place + 4 + 16 * count > len(data):
        raise ValueError("a vector is cut")
    return list(struct.iter_unpack("<qq", data[place + 4 : place + 4 + 16 * count]))
