"""A schema as a message of Arrow IPC: at the beginning of a journal, and in the footer of a Parquet file."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from functools import lru_cache

from livebode.tables.flat_buffers import FlatBuffer, number_at, referred, root, tables, text
from livebode.tables.schema import STRING, Field, Schema

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
