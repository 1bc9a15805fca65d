"""The footer of a Parquet file: columns, row groups and statistics, and a footer for some of them.

The structs are those of parquet.thrift, https://github.com/apache/parquet-format.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from typing import BinaryIO, NamedTuple

from livebode.tables.thrift_compact import BINARY, I32, I64, LIST, STRUCT, CompactReader, binary, integer, list_of
from livebode.tables.thrift_compact import struct_of as _struct

MAGIC = b"PAR1"
_FOOTER_BYTES_MAX = 1 << 23
_REPEATED = 2
_SIGNED = range(15, 19)  # converted types INT_8 to INT_64
_PLAIN_NUMBERS = {1: "<i", 2: "<q", 4: "<f", 5: "<d"}  # physical types whose statistics are numbers
_ENCODINGS = {0, *range(2, 10)}
_DEPTH_MAX = 64
_FILE_TAIL = 8


class Statistics(NamedTuple):
    """Of a column in a row group; None where the file does not have it, or the column has no plain numbers."""

    minimum: float | None
    maximum: float | None
    nulls: int | None


@dataclass(frozen=True)
class ColumnChunk:
    """The values of a leaf of the schema in a row group, and where its pages are in the file."""

    physical_type: int
    encodings: tuple[int, ...]
    path: tuple[bytes, ...]
    codec: int
    values: int
    size_bytes: int
    """Without compression."""
    compressed_bytes: int
    data_begin: int
    dictionary_begin: int | None
    minimum: bytes | None
    maximum: bytes | None
    nulls: int | None

    @property
    def begin(self) -> int:
        """First byte of its pages."""
        return self.data_begin if self.dictionary_begin is None else self.dictionary_begin


@dataclass(frozen=True)
class RowGroup:
    """Consecutive rows."""

    rows: int
    chunks: tuple[ColumnChunk, ...]

    @property
    def size_bytes(self) -> int:
        """Size of its values without compression."""
        return sum(chunk.size_bytes for chunk in self.chunks)


@dataclass(frozen=True)
class _Element:
    raw: bytes
    name: str
    children: int
    repeated: bool
    annotated: bool


@dataclass(frozen=True)
class ParquetColumn:
    """A column of the table: one leaf of the schema, or several where it is nested."""

    name: str
    elements: tuple[_Element, ...]
    leaves: range
    repeated: bool


@dataclass(frozen=True)
class Footer:
    """What a footer states. `begin` is its first byte in the file."""

    begin: int
    root: _Element
    columns: tuple[ParquetColumn, ...]
    groups: tuple[RowGroup, ...]
    metadata: Mapping[str, str]

    @property
    def rows(self) -> int:
        """Number of all rows."""
        return sum(group.rows for group in self.groups)

    def statistics(self, group: int, name: str) -> Statistics:
        """Those of a column in a row group; KeyError if there is no such column."""
        column = next((one for one in self.columns if one.name == name), None)
        if column is None:
            raise KeyError(name)
        chunk = self.groups[group].chunks[column.leaves.start]
        if len(column.elements) > 1 or column.elements[0].annotated:
            return Statistics(None, None, chunk.nulls)
        layout = _PLAIN_NUMBERS.get(chunk.physical_type, "")
        bounds = [_number(layout, data) for data in (chunk.minimum, chunk.maximum)]
        low, high = bounds if None not in bounds else (None, None)
        return Statistics(low, high, chunk.nulls)


def read_footer(file: BinaryIO) -> Footer:
    """The footer of the file.

    Raises
    ------
    ValueError
        If it is damaged, is not Parquet, or has parts that are not read: encryption, columns in other files.
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
        return _parsed(file.read(length), begin)
    except ValueError as error:
        raise ValueError(f"its footer is damaged: {error}") from None


def written_footer(footer: Footer, places: Sequence[int], groups: Sequence[int], metadata: Mapping[str, str]) -> bytes:
    """A footer, with the end of a file, in place of this one: only these columns and row groups, by number.

    It has no statistics: readers would use them for nothing but filters.
    """
    columns = [footer.columns[place] for place in places]
    root = _struct((4, BINARY, binary(footer.root.name.encode())), (5, I32, integer(len(columns))))
    elements = [root, *(element.raw for column in columns for element in column.elements)]
    leaves = [leaf for column in columns for leaf in column.leaves]
    chosen = [footer.groups[group] for group in groups]
    entries = [
        _struct((1, BINARY, binary(key.encode())), (2, BINARY, binary(value.encode())))
        for key, value in metadata.items()
    ]
    data = _struct(
        (1, I32, integer(2)),
        (2, LIST, list_of(STRUCT, elements)),
        (3, I64, integer(sum(group.rows for group in chosen))),
        (4, LIST, list_of(STRUCT, [_written_group(group, leaves) for group in chosen])),
        (5, LIST, list_of(STRUCT, entries)),
    )
    return data + len(data).to_bytes(4, "little") + MAGIC


def _written_group(group: RowGroup, leaves: Iterable[int]) -> bytes:
    chunks = [group.chunks[leaf] for leaf in leaves]
    return _struct(
        (1, LIST, list_of(STRUCT, [_written_chunk(chunk) for chunk in chunks])),
        (2, I64, integer(sum(chunk.size_bytes for chunk in chunks))),
        (3, I64, integer(group.rows)),
    )


def _written_chunk(chunk: ColumnChunk) -> bytes:
    fields = [
        (1, I32, integer(chunk.physical_type)),
        (2, LIST, list_of(I32, [integer(one) for one in chunk.encodings])),
        (3, LIST, list_of(BINARY, [binary(name) for name in chunk.path])),
        (4, I32, integer(chunk.codec)),
        (5, I64, integer(chunk.values)),
        (6, I64, integer(chunk.size_bytes)),
        (7, I64, integer(chunk.compressed_bytes)),
        (9, I64, integer(chunk.data_begin)),
    ]
    if chunk.dictionary_begin is not None:
        fields.append((11, I64, integer(chunk.dictionary_begin)))
    return _struct((2, I64, integer(0)), (3, STRUCT, _struct(*fields)))


def _parsed(data: bytes, begin: int) -> Footer:
    reader = CompactReader(data)
    elements: list[_Element] = []
    groups: list[RowGroup] = []
    metadata: dict[str, str] = {}
    rows = None
    for number, kind in reader.fields():
        if (number, kind) == (2, LIST):
            elements = [_element(reader) for _ in reader.items(STRUCT)]
        elif (number, kind) == (3, I64):
            rows = reader.integer()
        elif (number, kind) == (4, LIST):
            groups = [_group(reader) for _ in reader.items(STRUCT)]
        elif (number, kind) == (5, LIST):
            metadata = dict(_entry(reader) for _ in reader.items(STRUCT))
        elif (number, kind) == (8, STRUCT):
            raise ValueError("the file is encrypted")
        else:
            reader.skip(kind)
    columns = _columns(elements)
    for group in groups:
        _check(group, columns, begin)
    footer = Footer(begin, elements[0], columns, tuple(groups), metadata)
    if footer.rows != rows:
        raise ValueError(f"it declares {rows} rows, and row groups of {footer.rows}")
    return footer


def _element(reader: CompactReader) -> _Element:
    begin = reader.at
    name, children, repeated, annotated, signed = "", 0, False, False, False
    for number, kind in reader.fields():
        if (number, kind) == (4, BINARY):
            name = reader.binary().decode()
            if "\0" in name:  # arro3 ends the process at one
                raise ValueError("the name of a column contains a null character")
        elif (number, kind) == (5, I32):
            children = reader.integer()
        elif (number, kind) == (3, I32):
            repeated = reader.integer() == _REPEATED
        elif (number, kind) == (6, I32):
            annotated, signed = True, reader.integer() in _SIGNED
        else:
            annotated |= number == 10
            reader.skip(kind)
    return _Element(bytes(reader.data[begin : reader.at]), name, children, repeated, annotated and not signed)


def _entry(reader: CompactReader) -> tuple[str, str]:
    texts = {1: "", 2: ""}
    for number, kind in reader.fields():
        if number in texts and kind == BINARY:
            texts[number] = reader.binary().decode("utf-8", "replace")
        else:
            reader.skip(kind)
    return texts[1], texts[2]


def _group(reader: CompactReader) -> RowGroup:
    rows, chunks = -1, []
    for number, kind in reader.fields():
        if (number, kind) == (1, LIST):
            chunks = [_chunk(reader) for _ in reader.items(STRUCT)]
        elif (number, kind) == (3, I64):
            rows = reader.integer()
        else:
            reader.skip(kind)
    return RowGroup(rows, tuple(chunks))


def _chunk(reader: CompactReader) -> ColumnChunk:
    found = None
    for number, kind in reader.fields():
        if (number, kind) == (3, STRUCT):
            found = _column_metadata(reader)
        elif number == 1:
            raise ValueError("it has columns in other files")
        elif number in (8, 9):
            raise ValueError("the file is encrypted")
        else:
            reader.skip(kind)
    if found is None:
        raise ValueError("a column has no position")
    return found


_NUMBERS = {1: I32, 4: I32, 5: I64, 6: I64, 7: I64, 9: I64, 11: I64}
_REQUIRED = [1, 4, 5, 6, 7, 9]


def _column_metadata(reader: CompactReader) -> ColumnChunk:
    value: dict[int, int] = {}
    encodings: list[int] = []
    path: list[bytes] = []
    bounds: dict[int, bytes] = {}
    nulls = None
    for number, kind in reader.fields():
        if _NUMBERS.get(number) == kind:
            value[number] = reader.integer()
        elif (number, kind) == (2, LIST):
            encodings = [reader.integer() for _ in reader.items(I32)]
        elif (number, kind) == (3, LIST):
            path = [reader.binary() for _ in reader.items(BINARY)]
        elif (number, kind) == (12, STRUCT):
            bounds, nulls = _statistics(reader)
        else:
            reader.skip(kind)
    if missing := [number for number in _REQUIRED if number not in value]:
        raise ValueError(f"a column has no field {missing[0]}")
    physical_type, codec, values, size_bytes, compressed_bytes, data_begin = (value[number] for number in _REQUIRED)
    if physical_type not in range(8) or codec not in range(8) or not set(encodings) <= _ENCODINGS:
        raise ValueError(f"a column declares type {physical_type}, codec {codec} and encodings {encodings[:8]}")
    return ColumnChunk(
        physical_type, tuple(encodings), tuple(path), codec, values, size_bytes, compressed_bytes, data_begin,
        value.get(11) or None, bounds.get(6, bounds.get(2)), bounds.get(5, bounds.get(1)), nulls,
    )  # fmt: skip


def _statistics(reader: CompactReader) -> tuple[dict[int, bytes], int | None]:
    bounds: dict[int, bytes] = {}
    nulls = None
    for number, kind in reader.fields():
        if number in (1, 2, 5, 6) and kind == BINARY:
            bounds[number] = reader.binary()
        elif (number, kind) == (3, I64):
            nulls = reader.integer()
        else:
            reader.skip(kind)
    return bounds, nulls


def _columns(elements: Sequence[_Element]) -> tuple[ParquetColumn, ...]:
    if not elements:
        raise ValueError("it has no schema")
    columns: list[ParquetColumn] = []
    at, leaf = 1, 0
    for _ in range(elements[0].children):
        end, leaves = _end_of(elements, at, 0)
        part = tuple(elements[at:end])
        columns.append(ParquetColumn(part[0].name, part, range(leaf, leaf + leaves), any(one.repeated for one in part)))
        at, leaf = end, leaf + leaves
    if at != len(elements):
        raise ValueError("its schema has elements outside of the columns")
    return tuple(columns)


def _end_of(elements: Sequence[_Element], at: int, depth: int) -> tuple[int, int]:
    """The element after the one at `at` with all that is in it, and the number of leaves."""
    if at >= len(elements) or depth > _DEPTH_MAX:
        raise ValueError("its schema is not a tree")
    children, leaves = elements[at].children, 0
    at += 1
    for _ in range(children):
        at, inner = _end_of(elements, at, depth + 1)
        leaves += inner
    return at, leaves if children > 0 else 1


def _check(group: RowGroup, columns: Sequence[ParquetColumn], begin: int) -> None:
    leaves = columns[-1].leaves.stop if columns else 0
    if len(group.chunks) != leaves or group.rows < 0:
        raise ValueError(f"a row group has {group.rows} rows and {len(group.chunks)} columns of {leaves}")
    for column in columns:
        for chunk in (group.chunks[leaf] for leaf in column.leaves):
            if min(chunk.compressed_bytes, chunk.size_bytes, chunk.values) < 0:
                raise ValueError(f"column {column.name!r} has a negative size")
            within = len(MAGIC) <= chunk.begin <= chunk.data_begin <= chunk.begin + chunk.compressed_bytes <= begin
            if chunk.values and not within:
                raise ValueError(f"column {column.name!r} is outside of the file")
            if chunk.values != group.rows and not column.repeated:
                raise ValueError(f"column {column.name!r} has {chunk.values} values in {group.rows} rows")


def _number(layout: str, data: bytes | None) -> float | None:
    if not layout or data is None or len(data) != struct.calcsize(layout):
        return None
    (value,) = struct.unpack(layout, data)
    return None if isnan(value) else value
