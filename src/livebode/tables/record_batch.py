"""A table as one record batch message of Arrow IPC: the form of the rows in a journal.

The metadata that are written are a FlatBuffers table of one fixed layout: byte by byte that of Arrow's C++. Messages of
other writers are read as well. A message is untrusted data: what is read from it is never larger than the message.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
_HEADER_TYPE, _HEADER, _BODY_BYTES = 1, 2, 3  # numbers of the fields of Message, and below of RecordBatch
_ROWS, _NODES, _BUFFERS, _COMPRESSION = 0, 1, 2, 3
_RECORD_BATCH = 3


class _Buffer(NamedTuple):
    start: int
    length: int


def to_message(table: Table) -> bytes:
    """The rows; the schema is not among them."""
    buffers = [data for column in table.columns for data in _buffers_of(column)]
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
    columns = nullable_columns(payload, [field.kind for field in schema])
    if any(valid is not None for _, valid in columns):
        raise ValueError("the rows contain nulls")
    return Table(schema, tuple(column for column, _ in columns))


def nullable_columns(payload: memoryview, kinds: Sequence[str]) -> list[tuple[Column, NDArray[np.bool_] | None]]:
    """Columns of these kinds, and where each is not null; None without a null. Errors as in `from_message`."""
    metadata, body = _split(payload)
    message = _root(metadata)
    (header_type,) = _at("B", metadata, message, _HEADER_TYPE)
    header = _referred(metadata, message, _HEADER)
    if header_type != _RECORD_BATCH or header is None:
        raise ValueError("it is not a record batch")
    if _field(metadata, header, _COMPRESSION) is not None:
        raise ValueError("compressed rows")
    (rows,) = _at("q", metadata, header, _ROWS)
    nodes, pairs = _pairs(metadata, header, _NODES), _pairs(metadata, header, _BUFFERS)
    buffers = [_Buffer(start, length) for start, length in pairs]
    if rows < 0 or len(nodes) != len(kinds) or any(length != rows for length, _ in nodes):
        raise ValueError("its columns differ from its schema")
    if any(min(one) < 0 for one in buffers) or sum(one.length for one in buffers) > len(payload):
        raise ValueError(f"{len(payload)} bytes expand to more")
    if len(buffers) != sum(3 if kind == STRING else 2 for kind in kinds):
        raise ValueError("its buffers differ from its schema")
    each = iter(buffers)
    columns: list[tuple[Column, NDArray[np.bool_] | None]] = []
    for kind, (_, nulls) in zip(kinds, nodes):
        known = next(each)
        valid = _bits(body, known, rows) if nulls else None
        if kind == STRING:
            columns.append((_text(body, next(each), next(each), rows), valid))
        else:
            columns.append((_numbers(body, next(each), kind, rows), valid))
    return columns


def messages(stream: memoryview) -> Iterator[memoryview]:
    """Each message of an IPC stream in memory."""
    at = 0
    while at + _PREFIX.size <= len(stream) and (length := _PREFIX.unpack_from(stream, at)[1]):
        metadata = bytes(stream[at + _PREFIX.size : at + _PREFIX.size + length])
        message = _root(metadata)
        body_bytes = (
            0 if _field(metadata, message, _BODY_BYTES) is None else _at("q", metadata, message, _BODY_BYTES)[0]
        )
        end = at + _PREFIX.size + length + body_bytes
        yield stream[at:end]
        at = end


def _buffers_of(column: Column) -> Iterator[bytes | memoryview]:
    yield b""  # no bits of nulls
    if isinstance(column, Text):
        letters = [word.encode() for word in column.words]
        lengths = np.array([0, *map(len, letters)], dtype=np.int32)
        yield np.cumsum(lengths[np.concatenate([[0], column.at + 1])], dtype=np.int32).tobytes()
        yield b"".join([letters[number] for number in column.at.tolist()])
    elif column.dtype == np.bool_:
        yield np.packbits(column, bitorder="little").tobytes()
    else:
        yield column.tobytes()


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


def _root(data: bytes) -> int:
    return int(struct.unpack_from("<I", data)[0])


def _at(code: str, data: bytes, table: int, number: int) -> tuple[int, ...]:
    """The value of a field; 0 if it is absent."""
    place = _field(data, table, number)
    return (0,) if place is None else struct.unpack_from("<" + code, data, place)


def _referred(data: bytes, table: int, number: int) -> int | None:
    place = _field(data, table, number)
    return None if place is None else place + int(struct.unpack_from("<I", data, place)[0])


def _pairs(data: bytes, table: int, number: int) -> list[tuple[int, int]]:
    """A vector of two numbers each."""
    place = _referred(data, table, number)
    if place is None:
        return []
    (count,) = struct.unpack_from("<I", data, place)
    if place + 4 + 16 * count > len(data):
        raise ValueError("a vector is cut")
    return list(struct.iter_unpack("<qq", data[place + 4 : place + 4 + 16 * count]))


def _field(data: bytes, table: int, number: int) -> int | None:
    """Position of a field of a FlatBuffers table; None if it is absent."""
    layout = table - struct.unpack_from("<i", data, table)[0]
    entry = 4 + 2 * number
    if entry >= struct.unpack_from("<H", data, layout)[0]:
        return None
    offset = struct.unpack_from("<H", data, layout + entry)[0]
    return table + offset if offset else None
