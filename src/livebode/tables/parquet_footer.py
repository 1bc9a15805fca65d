"""The footer of a Parquet file: columns, row groups and statistics.

The structs are those of parquet.thrift, https://github.com/apache/parquet-format. Of a row group only what is asked for
becomes an object: a footer can have thousands of columns in row groups.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from livebode.dataclass import dataclass
from livebode.tables.arrow_ipc import schema_from_message
from livebode.tables.parquet_format import (
    ARROW_SCHEMA,
    BYTE_ARRAY,
    FORMS,
    MAGIC,
    OPTIONAL,
    PACKED_MAX,
    REPEATED,
    REQUIRED,
)
from livebode.tables.table import STRING, Field, Schema
from livebode.tables.thrift_compact import BINARY, I32, I64, LIST, STRUCT, Struct, decode, field

_FOOTER_BYTES_MAX = 1 << 23
_FILE_TAIL = 8
_DEPTH_MAX = 64
# Fields of FileMetaData, SchemaElement, KeyValue, RowGroup, ColumnChunk, ColumnMetaData and Statistics.
_ELEMENTS, _ROWS, _GROUPS, _PAIRS, _ENCRYPTED = field(2, LIST), field(3, I64), field(4, LIST), field(5, LIST), 8
_TYPE, _REPETITION, _NAME, _CHILDREN, _CONVERTED = (
    field(1, I32), field(3, I32), field(4, BINARY), field(5, I32), field(6, I32),
)  # fmt: skip
_LOGICAL = field(10, STRUCT)
_WRITER, _KEY, _VALUE = field(6, BINARY), field(1, BINARY), field(2, BINARY)
_CHUNKS, _SIZE, _GROUP_ROWS = field(1, LIST), field(2, I64), field(3, I64)
_OTHER_FILE, _ABOUT = field(1, BINARY), field(3, STRUCT)
_CODEC, _VALUES, _UNCOMPRESSED, _COMPRESSED = field(4, I32), field(5, I64), field(6, I64), field(7, I64)
_DATA_BEGIN, _DICTIONARY_BEGIN, _STATISTICS = field(9, I64), field(11, I64), field(12, STRUCT)
_MAXIMUM, _MINIMUM, _NULLS, _OLD_MAXIMUM, _OLD_MINIMUM = (
    field(5, BINARY), field(6, BINARY), field(3, I64), field(1, BINARY), field(2, BINARY),
)  # fmt: skip
_KINDS = {(form.physical, form.converted): kind for kind, form in FORMS.items()}
_KINDS |= {(1, 17): "int32", (2, 18): "int64"}


class Statistics(NamedTuple):
    """Of a column in a row group; None where the file does not have it, or the column has no plain numbers."""

    minimum: float | None
    maximum: float | None
    nulls: int | None


class ColumnChunk(NamedTuple):
    """The values of a column in a row group, and where its pages are in the file."""

    physical: int
    codec: int
    values: int
    begin: int
    stored_bytes: int


@dataclass(frozen=True)
class ParquetColumn:
    """A column of the table; its kind is None if it is not a plain number, truth value or text."""

    name: str
    kind: str | None
    optional: bool
    leaf: int
    """Number of its first leaf in the schema."""


@dataclass(frozen=True)
class RowGroup:
    """Consecutive rows. `size_bytes` is that without compression, as the footer states it."""

    rows: int
    size_bytes: int
    chunks: Sequence[Any]


@dataclass(frozen=True)
class Footer:
    """What a footer states. `begin` is its first byte in the file, `writer` the program that wrote it."""

    begin: int
    columns: tuple[ParquetColumn, ...]
    groups: tuple[RowGroup, ...]
    metadata: Mapping[str, str]
    writer: str

    @property
    def rows(self) -> int:
        """Number of all rows."""
        return sum(group.rows for group in self.groups)

    def schema_of(self, columns: Sequence[ParquetColumn]) -> Schema:
        """The schema of a table of these columns, with their metadata; TypeError if one cannot be in a table."""
        if wrong := [column.name for column in columns if column.kind is None]:
            raise TypeError(f"column {wrong[0]!r} is of a type that a table does not have: read it with PyArrow")
        metadata = self._arrow_fields()
        fields = tuple(Field(column.name, column.kind or "", metadata.get(column.name, {})) for column in columns)
        return Schema(fields, {key: value for key, value in self.metadata.items() if key != ARROW_SCHEMA})

    def statistics(self, group: int, name: str) -> Statistics:
        """Those of a column in a row group; KeyError if there is no such column."""
        column = next((each for each in self.columns if each.name == name), None)
        if column is None:
            raise KeyError(name)
        statistics = _inner(_inner(self.groups[group].chunks[column.leaf], _ABOUT), _STATISTICS)
        data = (
            statistics.get(_MINIMUM, statistics.get(_OLD_MINIMUM)),
            statistics.get(_MAXIMUM, statistics.get(_OLD_MAXIMUM)),
        )
        low, high = (None if bound is None else _number(column, bound) for bound in data)
        return (
            Statistics(low, high, statistics.get(_NULLS))
            if None not in (low, high)
            else Statistics(None, None, statistics.get(_NULLS))
        )

    def chunk(self, group: int, column: ParquetColumn) -> ColumnChunk:
        """Where a column of a row group is; ValueError if the footer contradicts itself there."""
        whole = self.groups[group].chunks[column.leaf]
        about = _inner(whole, _ABOUT)
        try:
            physical, codec, values, stored, begin = (
                about[key] for key in (_TYPE, _CODEC, _VALUES, _COMPRESSED, _DATA_BEGIN)
            )
        except KeyError as missing:
            raise ValueError(f"column {column.name!r} has no field {missing.args[0] >> 4}") from None
        begin = min(begin, about.get(_DICTIONARY_BEGIN) or begin)
        if _OTHER_FILE in whole:
            raise ValueError(f"column {column.name!r} is in another file")
        if values != self.groups[group].rows:
            raise ValueError(f"column {column.name!r} has {values} values in {self.groups[group].rows} rows")
        if not len(MAGIC) <= begin <= begin + stored <= self.begin:
            raise ValueError(f"column {column.name!r} is outside of the file")
        if 8 * values > PACKED_MAX * stored:
            raise ValueError(f"column {column.name!r} has {values} values in {stored} bytes")
        if column.kind is None or physical != FORMS[column.kind].physical:
            raise ValueError(f"column {column.name!r} is of type {physical}")
        return ColumnChunk(physical, codec, values, begin, stored)

    def _arrow_fields(self) -> dict[str, Mapping[str, str]]:
        """Metadata of columns, which Parquet has no place for."""
        encoded = self.metadata.get(ARROW_SCHEMA)
        if encoded is None:
            return {}
        try:
            return {one.name: one.metadata for one in schema_from_message(base64.b64decode(encoded))}
        except TypeError:  # of a column that is not read
            return {}


def read_footer(file: BinaryIO) -> Footer:
    """The footer of the file.

    Raises
    ------
    ValueError
        If it is damaged, is not Parquet, or is encrypted.
    """
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - _FILE_TAIL))
    tail = file.read(_FILE_TAIL)
    if size < len(MAGIC) + _FILE_TAIL or tail[4:] != MAGIC:
        raise ValueError("it does not end as a Parquet file does")
    length = int.from_bytes(tail[:4], "little")
    begin = size - _FILE_TAIL - length
    if begin < len(MAGIC):
        raise ValueError(f"it declares a footer of {length} bytes")
    if length > _FOOTER_BYTES_MAX:
        raise ValueError(f"its footer has {length} bytes, more than {_FOOTER_BYTES_MAX}")
    file.seek(begin)
    try:
        return _parsed(decode(file.read(length))[0], begin)
    except (ValueError, KeyError, AttributeError) as error:
        raise ValueError(f"its footer is damaged: {error}") from None


def _parsed(data: Struct, begin: int) -> Footer:
    if any(key >> 4 == _ENCRYPTED for key in data):
        raise ValueError("the file is encrypted")
    elements = _structs(data, _ELEMENTS)
    columns, leaves = _columns(elements)
    groups = tuple(_group(group, leaves) for group in _structs(data, _GROUPS))
    metadata = {_text(pair.get(_KEY, b"")): _text(pair.get(_VALUE, b"")) for pair in _structs(data, _PAIRS)}
    footer = Footer(begin, columns, groups, metadata, _text(data.get(_WRITER, b"")))
    if footer.rows != data.get(_ROWS):
        raise ValueError(f"it declares {data.get(_ROWS)} rows, and row groups of {footer.rows}")
    return footer


def _group(data: Struct, leaves: int) -> RowGroup:
    rows, chunks = data.get(_GROUP_ROWS, -1), _structs(data, _CHUNKS)
    if len(chunks) != leaves or rows < 0:
        raise ValueError(f"a row group has {rows} rows and {len(chunks)} columns of {leaves}")
    return RowGroup(rows, data.get(_SIZE, 0), chunks)


def _columns(elements: Sequence[Struct]) -> tuple[tuple[ParquetColumn, ...], int]:
    """The columns, and the number of leaves."""
    if not elements:
        raise ValueError("it has no schema")
    columns: list[ParquetColumn] = []
    index, leaf = 1, 0
    for _ in range(elements[0].get(_CHILDREN, 0)):
        end, leaves = _end_of(elements, index, 0)
        columns.append(_column(elements[index], leaf))
        index, leaf = end, leaf + leaves
    if index != len(elements):
        raise ValueError("its schema has elements outside of the columns")
    names = [column.name for column in columns]
    if len(set(names)) < len(names):
        raise ValueError("two columns have the same name")
    return tuple(columns), leaf


def _end_of(elements: Sequence[Struct], index: int, depth: int) -> tuple[int, int]:
    """The element after the one at this index with all that is in it, and the number of leaves."""
    if index >= len(elements) or depth > _DEPTH_MAX:
        raise ValueError("its schema is not a tree")
    children, leaves = elements[index].get(_CHILDREN, 0), 0
    index += 1
    for _ in range(children):
        index, inner = _end_of(elements, index, depth + 1)
        leaves += inner
    return index, leaves if children > 0 else 1


def _column(element: Struct, leaf: int) -> ParquetColumn:
    repetition = element.get(_REPETITION, REQUIRED)
    plain = repetition != REPEATED and not element.get(_CHILDREN, 0)
    return ParquetColumn(element[_NAME].decode(), _kind(element) if plain else None, repetition == OPTIONAL, leaf)


def _kind(element: Struct) -> str | None:
    physical, converted, logical = element.get(_TYPE, -1), element.get(_CONVERTED), element.get(_LOGICAL)
    if converted is None and logical:  # only newer writers state a text so, and times of nanoseconds
        return STRING if physical == BYTE_ARRAY and field(1, STRUCT) in logical else None
    return _KINDS.get((physical, converted))


def _structs(data: Struct, key: int) -> list[Struct]:
    structs = data.get(key, [])
    if not all(type(struct) is dict for struct in structs):
        raise ValueError("a list has values of another type")
    return list(structs)


def _inner(data: Struct, key: int) -> Struct:
    inner: Struct = data.get(key, {})
    return inner


def _text(data: bytes) -> str:
    return data.decode("utf-8", "replace")


def _number(column: ParquetColumn, data: bytes) -> float | None:
    if column.kind in (None, STRING, "bool"):
        return None
    dtype = np.dtype(FORMS[column.kind or ""].dtype)
    if len(data) != dtype.itemsize:
        return None
    (value,) = np.frombuffer(data, dtype).tolist()
    return None if value != value else value
