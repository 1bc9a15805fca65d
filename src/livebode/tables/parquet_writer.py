"""ParquetWriter: a Parquet file group by group, as tables come; a column is plain, or a dictionary and its numbers."""

from __future__ import annotations

import base64
from collections.abc import Collection, Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import lz4.block
import numpy as np
from numpy.typing import NDArray

from livebode.tables.arrow_ipc import schema_to_message
from livebode.tables.parquet_format import (
    ARROW_SCHEMA,
    BOOLEAN,
    DATA_PAGE,
    DICTIONARY_PAGE,
    FORMS,
    LZ4_RAW,
    MAGIC,
    PLAIN,
    REQUIRED,
    RLE,
    RLE_DICTIONARY,
    UNCOMPRESSED,
    WRITER,
)  # fmt: skip
from livebode.tables.table import Column, Field, Schema, Table, Text
from livebode.tables.thrift_compact import BINARY, I32, I64, LIST, STRUCT, binary, integer, list_of, struct_of, unsigned

_PAGE_ROWS = 1 << 17  # 1 MiB of doubles
_PROBE_BYTES = 1 << 12
_Buffer = bytes | memoryview


class Page(NamedTuple):
    """A page before its compression."""

    kind: int
    values: int
    encoding: int
    data: _Buffer


class Bounds(NamedTuple):
    """Least and greatest value as bytes; None without a number."""

    minimum: bytes | None
    maximum: bytes | None


def encoded(column: Column, kind: str, *, repeating: bool) -> tuple[list[Page], Bounds]:
    """The pages of a column with at least one row; with a dictionary if it is text, or `repeating` and it is shorter.

    Numbers are not copied.
    """
    if isinstance(column, Text):
        used, numbers = _used(column)
        words = [word.encode() for word in used]
        dictionary = b"".join(len(word).to_bytes(4, "little") + word for word in words)
        return _coded(dictionary, len(words), numbers), Bounds(min(words), max(words))
    form = FORMS[kind]
    if form.physical == BOOLEAN:
        bits = [np.packbits(part, bitorder="little").data for part in _parts(column)]
        pages = [Page(DATA_PAGE, min(_PAGE_ROWS, len(column) - k * _PAGE_ROWS), PLAIN, b) for k, b in enumerate(bits)]
        return pages, Bounds(column.all().tobytes(), column.any().tobytes())
    values = np.ascontiguousarray(column, form.dtype)
    if repeating and (coded := _dictionary_of(values)) is not None:
        distinct, numbers = coded
        return _coded(distinct.data.cast("B"), len(distinct), numbers), _bounds(distinct)
    return [Page(DATA_PAGE, len(part), PLAIN, part.data.cast("B")) for part in _parts(values)], _bounds(values)


def _parts(values: NDArray[Any]) -> Iterator[NDArray[Any]]:
    for begin in range(0, len(values), _PAGE_ROWS):
        yield values[begin : begin + _PAGE_ROWS]


def _coded(dictionary: _Buffer, words: int, numbers: NDArray[np.integer[Any]]) -> list[Page]:
    """Numbers of words take whole bytes each: they compress better than those that take single bits."""
    width = 1 if words <= 1 << 8 else 2 if words <= 1 << 16 else 4
    codes = numbers.astype(f"<u{width}")
    pages = [Page(DICTIONARY_PAGE, words, PLAIN, dictionary)]
    for part in _parts(codes):
        head = bytes([8 * width]) + unsigned(-(-len(part) // 8) << 1 | 1)
        data = b"".join((head, part.data, bytes(-len(part) % 8 * width)))
        pages.append(Page(DATA_PAGE, len(part), RLE_DICTIONARY, data))
    return pages


def _dictionary_of(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.integer[Any]]] | None:
    """Different values, by their bits, and their numbers in the rows; None if most differ."""
    bits = values.view(f"i{values.itemsize}")
    begins = np.concatenate(([0], np.flatnonzero(bits[1:] != bits[:-1]) + 1))
    if 2 * len(begins) <= len(bits):  # over the lines of a response
        words, numbers = np.unique(bits[begins], return_inverse=True)
        numbers = np.repeat(numbers, np.diff(begins, append=len(bits)))
    elif 2 * (period := _period(bits)) <= len(bits):  # over responses
        words, numbers = np.unique(bits[:period], return_inverse=True)
        numbers = np.tile(numbers, -(-len(bits) // period))[: len(bits)]
    else:
        words = np.unique(bits)
        if 2 * len(words) > len(bits):
            return None
        numbers = np.searchsorted(words, bits)
    return words.view(values.dtype), numbers


def _period(bits: NDArray[Any]) -> int:
    """The number of values after which all come again."""
    if len(bits) < 2:
        return len(bits)
    again = int(np.argmax(bits[1:] == bits[0])) + 1
    return again if np.array_equal(bits[again:], bits[:-again]) else len(bits)


def _used(column: Text) -> tuple[list[str], NDArray[np.integer[Any]]]:
    """The words that are in a row, and their numbers."""
    is_used = np.bincount(column.at, minlength=len(column.words)) > 0
    return [word for word, used in zip(column.words, is_used) if used], (np.cumsum(is_used) - 1)[column.at]


def _bounds(values: NDArray[Any]) -> Bounds:
    if values.dtype.kind != "f":
        return Bounds(values.min().tobytes(), values.max().tobytes())
    low, high = values.min(), values.max()
    if np.isnan(low):
        low, high = np.fmin.reduce(values), np.fmax.reduce(values)  # slower, without the NaN
    if np.isnan(low):
        return Bounds(None, None)
    zero = values.dtype.type(0)  # Parquet demands that a bound of zero includes both signs
    return Bounds((low if low else -zero).tobytes(), (high if high else zero).tobytes())


_Pairs = tuple[tuple[str, str], ...]
_VERSION = 2
_EMPTY = struct_of()
_TYPE_ORDER = struct_of((1, STRUCT, _EMPTY))  # statistics compare as the type of the column does
_PLAIN, _CODED = (list_of(I32, [integer(one) for one in each]) for each in ([PLAIN], [PLAIN, RLE_DICTIONARY]))
_RLE = integer(RLE)
_NO_NULLS = integer(0)


class ByteSink(Protocol):
    """What a Parquet file is written to: a file, or what passes its bytes on."""

    def write(self, data: bytes, /) -> object: ...

    def writelines(self, lines: Iterable[bytes | memoryview], /) -> None: ...


class ParquetWriter:
    """Writes each table as one row group, with statistics, compressed by LZ4 where that makes it smaller.

    Parameters
    ----------
    file
        Empty; it is not closed.
    schema
        Of all tables.
    repeating
        Columns whose values repeat: they have a dictionary, as text has.

    Raises
    ------
    TypeError
        If a column is of half precision.
    """

    def __init__(self, file: ByteSink, schema: Schema, repeating: Collection[str] = ()) -> None:
        if wrong := [field.name for field in schema if field.kind not in FORMS]:
            raise TypeError(f"column {wrong[0]!r} is of half precision")
        self._file, self._schema, self._repeating = file, schema, frozenset(repeating)
        self._groups: list[bytes] = []
        self._rows = 0
        self._end = len(MAGIC)
        file.write(MAGIC)

    def write(self, table: Table) -> None:
        """Append the rows as a row group; ValueError if their schema differs."""
        if table.schema != self._schema:
            raise ValueError("the table has another schema than the file")
        if not table.num_rows:
            return
        begin, size_bytes = self._end, 0
        pages: list[bytes | memoryview] = []
        columns = []
        for field, column in zip(self._schema, table.columns):
            chunk = _Chunk(field, column, field.name in self._repeating)
            pages += chunk.parts
            columns.append(chunk.metadata(self._end, table.num_rows))
            self._end += chunk.stored_bytes
            size_bytes += chunk.size_bytes
        self._file.writelines(pages)
        self._rows += table.num_rows
        self._groups.append(
            struct_of(
                (1, LIST, list_of(STRUCT, columns)),
                (2, I64, integer(size_bytes)),
                (3, I64, integer(table.num_rows)),
                (5, I64, integer(begin)),
                (6, I64, integer(self._end - begin)),
            )
        )

    def close(self) -> None:
        """Write the footer."""
        columns = tuple((field.name, field.kind, tuple(field.metadata.items())) for field in self._schema)
        elements, metadata = _of_schema(columns, tuple(self._schema.metadata.items()))
        footer = struct_of(
            (1, I32, integer(_VERSION)),
            (2, LIST, elements),
            (3, I64, integer(self._rows)),
            (4, LIST, list_of(STRUCT, self._groups)),
            (5, LIST, metadata),
            (6, BINARY, binary(WRITER.encode())),
            (7, LIST, list_of(STRUCT, [_TYPE_ORDER] * len(self._schema))),
        )
        self._file.write(footer + len(footer).to_bytes(4, "little") + MAGIC)


def write_parquet(path: Path, table: Table, rows: int = 1 << 16) -> None:
    """Write a table as a new file, in row groups of so many rows."""
    with path.open("wb") as file:
        writer = ParquetWriter(file, table.schema)
        for begin in range(0, table.num_rows, rows):
            writer.write(table.slice(begin, rows))
        writer.close()


@lru_cache(64)
def _of_schema(columns: tuple[tuple[str, str, _Pairs], ...], metadata: _Pairs) -> tuple[bytes, bytes]:
    """Schema and metadata in a footer; a run writes the same in each segment."""
    schema = Schema(tuple(Field(name, kind, dict(pairs)) for name, kind, pairs in columns), dict(metadata))
    root = struct_of((4, BINARY, binary(b"schema")), (5, I32, integer(len(schema))))
    arrow = base64.b64encode(schema_to_message(schema)).decode()
    entries = [_entry(key, value) for key, value in (*metadata, (ARROW_SCHEMA, arrow))]
    return list_of(STRUCT, [root, *map(_element, schema)]), list_of(STRUCT, entries)


def _is_compressible(data: _Buffer) -> bool:
    """Whether parts of a page become smaller: measured numbers, most of a file, are not compressed in vain."""
    if len(data) <= 4 * _PROBE_BYTES:
        return True
    places = 0, len(data) // 2, len(data) - _PROBE_BYTES
    parts = b"".join(data[begin : begin + _PROBE_BYTES] for begin in places)
    return _saves(len(lz4.block.compress(parts, store_size=False)), len(parts))


def _saves(stored_bytes: int, size_bytes: int) -> bool:
    return 10 * stored_bytes < 9 * size_bytes


class _Chunk:
    """The pages of a column in a row group."""

    def __init__(self, field: Field, column: Column, repeating: bool) -> None:
        self._field = field
        pages, self._bounds = encoded(column, field.kind, repeating=repeating)
        self._has_dictionary = pages[0].kind == DICTIONARY_PAGE
        stored, size_bytes = [page.data for page in pages], sum(len(page.data) for page in pages)
        self._codec = UNCOMPRESSED  # is read without a copy
        if _is_compressible(pages[-1].data):
            smaller = [lz4.block.compress(page.data, store_size=False) for page in pages]
            if _saves(sum(map(len, smaller)), size_bytes):
                self._codec, stored = LZ4_RAW, smaller
        heads = [_page_header(page, len(data)) for page, data in zip(pages, stored)]
        self.parts = [part for pair in zip(heads, stored) for part in pair]
        self.size_bytes = sum(map(len, heads)) + size_bytes
        self.stored_bytes = sum(map(len, self.parts))
        self._dictionary_bytes = len(heads[0]) + len(stored[0]) if self._has_dictionary else 0

    def metadata(self, begin: int, rows: int) -> bytes:
        """Parquet's ColumnChunk of the pages at this place in the file."""
        fields = [
            (1, I32, integer(FORMS[self._field.kind].physical)),
            (2, LIST, _CODED if self._has_dictionary else _PLAIN),
            (3, LIST, list_of(BINARY, [binary(self._field.name.encode())])),
            (4, I32, integer(self._codec)),
            (5, I64, integer(rows)),
            (6, I64, integer(self.size_bytes)),
            (7, I64, integer(self.stored_bytes)),
            (9, I64, integer(begin + self._dictionary_bytes)),
        ]
        if self._has_dictionary:
            fields.append((11, I64, integer(begin)))
        fields.append((12, STRUCT, _statistics(self._bounds)))
        return struct_of((2, I64, integer(begin)), (3, STRUCT, struct_of(*fields)))


def _statistics(bounds: Bounds) -> bytes:
    nulls = (3, I64, _NO_NULLS)
    if bounds.minimum is None or bounds.maximum is None:
        return struct_of(nulls)
    return struct_of(nulls, (5, BINARY, binary(bounds.maximum)), (6, BINARY, binary(bounds.minimum)))


def _page_header(page: Page, stored_bytes: int) -> bytes:
    about = [(1, I32, integer(page.values)), (2, I32, integer(page.encoding))]
    if page.kind == DICTIONARY_PAGE:
        inner = 7, STRUCT, struct_of(*about)
    else:
        inner = 5, STRUCT, struct_of(*about, (3, I32, _RLE), (4, I32, _RLE))
    sizes = (2, I32, integer(len(page.data))), (3, I32, integer(stored_bytes))
    return struct_of((1, I32, integer(page.kind)), *sizes, inner)


def _element(field: Field) -> bytes:
    form = FORMS[field.kind]
    fields = [(1, I32, integer(form.physical)), (3, I32, integer(REQUIRED)), (4, BINARY, binary(field.name.encode()))]
    if form.converted is not None:
        fields.append((6, I32, integer(form.converted)))
    return struct_of(*fields)


def _entry(key: str, value: str) -> bytes:
    return struct_of((1, BINARY, binary(key.encode())), (2, BINARY, binary(value.encode())))
