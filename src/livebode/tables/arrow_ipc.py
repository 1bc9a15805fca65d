"""Arrow IPC: schemas and record batches as flat buffers."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.tables.table import STRING, Column, Field, Schema, Table, Text


def root(data: bytes) -> int:
    """Position of the first table."""
    return int(struct.unpack_from("<I", data)[0])


def field_at(data: bytes, table: int, number: int) -> int | None:
    """Position of a field of a table; None if it is absent."""
    layout = table - struct.unpack_from("<i", data, table)[0]
    entry = 4 + 2 * number
    if entry >= struct.unpack_from("<H", data, layout)[0]:
        return None
    offset = struct.unpack_from("<H", data, layout + entry)[0]
    return table + offset if offset else None


def number_at(code: str, data: bytes, table: int, number: int) -> int:
    """The value of a field, of this code of `struct`; 0 if it is absent."""
    place = field_at(data, table, number)
    return 0 if place is None else int(struct.unpack_from("<" + code, data, place)[0])


def referred(data: bytes, table: int, number: int) -> int | None:
    """Position to which a field refers; None if it is absent."""
    place = field_at(data, table, number)
    return None if place is None else place + int(struct.unpack_from("<I", data, place)[0])


def text(data: bytes, table: int, number: int) -> str:
    """The text of a field; "" if it is absent."""
    place = referred(data, table, number)
    if place is None:
        return ""
    (size,) = struct.unpack_from("<I", data, place)
    if place + 4 + size > len(data):
        raise ValueError("a text is cut")
    return data[place + 4 : place + 4 + size].decode("utf-8", "replace")


def tables(data: bytes, table: int, number: int) -> list[int]:
    """Positions of the tables in a vector."""
    place = referred(data, table, number)
    if place is None:
        return []
    (count,) = struct.unpack_from("<I", data, place)
    if place + 4 + 4 * count > len(data):
        raise ValueError("a vector is cut")
    at = range(place + 4, place + 4 + 4 * count, 4)
    return [here + int(struct.unpack_from("<I", data, here)[0]) for here in at]


class FlatBuffer:
    """Bytes of tables: one that is referred to comes after the one that refers to it."""

    def __init__(self) -> None:
        self.data = bytearray(4)

    def table(self, *fields: tuple[str, int] | None) -> tuple[int, list[int]]:
        """Append a table of these codes of `struct` and values, by number; its position, and those of its fields."""
        layout = struct.calcsize("<i")
        offsets = []
        for one in fields:
            size = 0 if one is None else struct.calcsize("<" + one[0])
            layout += -layout % size if size else 0
            offsets.append(layout if size else 0)
            layout += size
        head = 4 + 2 * len(fields)
        self.data += bytes(-(len(self.data) + head) % 4)
        self.data += struct.pack(f"<HH{len(fields)}H", head, layout, *offsets)
        begin = len(self.data)
        self.data += struct.pack("<i", head) + bytes(layout - 4)
        for one, offset in zip(fields, offsets):
            if one is not None:
                struct.pack_into("<" + one[0], self.data, begin + offset, one[1])
        return begin, [begin + offset for offset in offsets]

    def refer(self, place: int, target: int) -> None:
        """Let the field at `place` refer to `target`."""
        struct.pack_into("<I", self.data, place, target - place)

    def text(self, place: int, value: str) -> None:
        """Append a text, to which the field at `place` refers."""
        letters = value.encode()
        self.refer(place, self._aligned())
        self.data += struct.pack("<I", len(letters)) + letters + b"\0"

    def vector(self, place: int, count: int) -> Sequence[int]:
        """Append a vector, to which the field at `place` refers; the positions of its references."""
        begin = self._aligned()
        self.refer(place, begin)
        self.data += struct.pack("<I", count) + bytes(4 * count)
        return range(begin + 4, begin + 4 + 4 * count, 4)

    def _aligned(self) -> int:
        self.data += bytes(-len(self.data) % 4)
        return len(self.data)


_PREFIX = struct.Struct("<II")
_CONTINUES = 0xFFFFFFFF
_V5, _SCHEMA = 4, 1  # of Arrow's Message.fbs
_HEADER_TYPE, _HEADER = 1, 2  # numbers of the fields of Message, and below of Schema, Field, KeyValue and types
_FIELDS, _METADATA = 1, 2
_NAME, _NULLABLE, _TYPE_TYPE, _TYPE, _DICTIONARY, _CHILDREN, _FIELD_METADATA = range(7)
_KEY, _VALUE = 0, 1
_BITS, _SIGNED, _PRECISION = 0, 1, 0
_INT, _FLOAT, _UTF8, _BOOL, _LARGE_UTF8, _UTF8_VIEW = 2, 3, 5, 6, 20, 24  # of Schema.fbs
_FLOATS = ("float16", "float32", "float64")
# Message and RecordBatch of Arrow's Message.fbs: root, layout and fields of both, and the number of buffers.
_HEAD = struct.Struct("<I4x6HiBBHIq2x5HiIIq4xI")
_MESSAGE = 20, 12, 22, 6, 5, 8, 12, 12, 0, 3, 4, 24
_BATCH = 10, 24, 12, 4, 8, 10
_TO_BUFFERS, _TO_NODES = 16, 28  # from the places of these offsets; the nodes are after the buffers
_ROWS, _NODES, _BUFFERS, _COMPRESSION = range(4)  # numbers of the fields of RecordBatch
_RECORD_BATCH = 3


def schema_to_message(schema: Schema) -> bytes:
    """The schema with all metadata."""
    out = FlatBuffer()
    message, places = out.table(("H", _V5), ("B", _SCHEMA), ("I", 0))
    out.refer(0, message)
    header, at = out.table(None, ("I", 0), ("I", 0) if schema.metadata else None)
    out.refer(places[_HEADER], header)
    for place, field in zip(out.vector(at[_FIELDS], len(schema)), schema):
        _write_field(out, place, field)
    if schema.metadata:
        _write_metadata(out, at[_METADATA], schema.metadata)
    out.data += bytes(-len(out.data) % 8)
    return _PREFIX.pack(_CONTINUES, len(out.data)) + bytes(out.data)


@lru_cache(64)
def schema_from_message(message: bytes) -> Schema:
    """Inverse of `schema_to_message`, also of those that others wrote.

    Raises
    ------
    ValueError
        If it cannot be read.
    TypeError
        If a column contains neither numbers, truth values nor text.
    """
    begin = 8 if message[:4] == b"\xff\xff\xff\xff" else 4  # messages from before Arrow 0.15 have no mark
    data = message[begin:]
    try:
        place = root(data)
        header = referred(data, place, _HEADER)
        if number_at("B", data, place, _HEADER_TYPE) != _SCHEMA or header is None:
            raise ValueError("it is of another type")
        fields = tables(data, header, _FIELDS)
        _check_texts(data, fields, tables(data, header, _METADATA))
        return Schema(tuple(_field(data, one) for one in fields), _metadata(data, header, _METADATA))
    except (struct.error, ValueError) as error:
        raise ValueError(f"it is not a schema of Arrow ({error})") from None


def _write_field(out: FlatBuffer, place: int, field: Field) -> None:
    kind = _UTF8 if field.kind == STRING else _BOOL if field.kind == "bool" else _INT if "int" in field.kind else _FLOAT
    metadata = ("I", 0) if field.metadata else None
    begin, at = out.table(("I", 0), ("B", 1), ("B", kind), ("I", 0), None, ("I", 0), metadata)
    out.refer(place, begin)
    out.text(at[_NAME], field.name)
    if kind == _INT:
        of_type, _ = out.table(("i", 8 * field.dtype.itemsize), ("B", field.dtype.kind == "i"))
    elif kind == _FLOAT:
        of_type, _ = out.table(("h", _FLOATS.index(field.kind)))
    else:
        of_type, _ = out.table()
    out.refer(at[_TYPE], of_type)
    out.vector(at[_CHILDREN], 0)
    if field.metadata:
        _write_metadata(out, at[_FIELD_METADATA], field.metadata)


def _write_metadata(out: FlatBuffer, place: int, metadata: Mapping[str, str]) -> None:
    for entry, (key, value) in zip(out.vector(place, len(metadata)), metadata.items()):
        begin, at = out.table(("I", 0), ("I", 0))
        out.refer(entry, begin)
        out.text(at[_KEY], key)
        out.text(at[_VALUE], value)


def _check_texts(data: bytes, fields: list[int], metadata: list[int]) -> None:
    """Texts may be shared, and would then expand to any size."""
    entries = metadata + [entry for one in fields for entry in tables(data, one, _FIELD_METADATA)]
    places = [referred(data, one, _NAME) for one in fields]
    places += [referred(data, entry, number) for entry in entries for number in (_KEY, _VALUE)]
    if sum(struct.unpack_from("<I", data, place)[0] for place in places if place is not None) > len(data):
        raise ValueError(f"{len(data)} bytes expand to more")


def _field(data: bytes, place: int) -> Field:
    return Field(text(data, place, _NAME), _kind(data, place), _metadata(data, place, _FIELD_METADATA))


def _kind(data: bytes, place: int) -> str:
    kind, of_type = number_at("B", data, place, _TYPE_TYPE), referred(data, place, _TYPE)
    if of_type is None:
        raise ValueError("a column has no type")
    if kind in (_UTF8, _LARGE_UTF8, _UTF8_VIEW):
        return STRING
    if kind == _BOOL:
        return "bool"
    if kind == _FLOAT:
        return _FLOATS[min(2, number_at("H", data, of_type, _PRECISION))]
    if kind == _INT:
        signed = number_at("B", data, of_type, _SIGNED)
        return f"{'' if signed else 'u'}int{number_at('i', data, of_type, _BITS)}"
    raise TypeError(f"column {text(data, place, _NAME)!r} is of type {kind} of Arrow")


def _metadata(data: bytes, table: int, number: int) -> dict[str, str]:
    return {text(data, entry, _KEY): text(data, entry, _VALUE) for entry in tables(data, table, number)}


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
