"""Parquet files: their pages, and their row groups as tables."""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import lz4.block
import numpy as np
from numpy.typing import NDArray

from livebode.kernel import decode_runs
from livebode.tables.parquet_footer import ColumnChunk, Footer, ParquetColumn, read_footer
from livebode.tables.parquet_format import (
    BIT_PACKED,
    CODECS,
    DATA_PAGE,
    DICTIONARY_PAGE,
    FORMS,
    INDEX_PAGE,
    LZ4_RAW,
    PLAIN,
    PLAIN_DICTIONARY,
    RLE,
    RLE_DICTIONARY,
    UNCOMPRESSED,
)  # fmt: skip
from livebode.tables.table import STRING, Column, Field, Schema, Table, Text
from livebode.tables.thrift_compact import I32, STRUCT, Struct, decode, field

_TEXT_BYTES_MAX = 1 << 26
_WORDS_MAX = 1 << 20  # other programs limit a dictionary to 1 MiB
_LZ4_RATIO_MAX = 255  # each byte of a block adds at most so many
_KIND, _SIZE, _STORED, _CRC = (field(number, I32) for number in range(1, 5))
_DATA, _DICTIONARY = field(5, STRUCT), field(7, STRUCT)
_VALUES, _ENCODING, _LEVELS, _REPETITIONS = (field(number, I32) for number in range(1, 5))


class ForeignFormError(ValueError):
    """Values in a form of Parquet that livebode does not write."""


def column_of(data: memoryview, chunk: ColumnChunk, column: ParquetColumn) -> Column:
    """The values in the bytes of a column; a null is NaN, in a column of integers too, False or "".

    Raises
    ------
    ForeignFormError
        If a page has a form that livebode does not write.
    ValueError
        If a page is damaged.
    """
    if chunk.codec not in (UNCOMPRESSED, LZ4_RAW):
        name = CODECS[chunk.codec] if 0 <= chunk.codec < len(CODECS) else chunk.codec
        raise ForeignFormError(f"it is compressed by {name}")
    return joined(iter(_Pages(data, chunk, column)), chunk.values)


def joined(parts: Iterator[Column], rows: int) -> Column:
    """The parts, one after the other, with so many rows in all, at least one; each is freed after it was copied."""
    first = next(parts)
    if isinstance(first, Text):
        return Text.join([first, *(part for part in parts if isinstance(part, Text))])
    if len(first) == rows:
        return first
    column, filled = np.empty(rows, first.dtype), len(first)
    column[:filled] = first
    for part in parts:
        if isinstance(part, Text) or part.dtype != column.dtype:  # some have nulls, so all are doubles
            column = column.astype(np.float64)
        column[filled : filled + len(part)] = part
        filled += len(part)
    return column


class _Pages:
    """Iterates over the values of each data page."""

    def __init__(self, data: memoryview, chunk: ColumnChunk, column: ParquetColumn) -> None:
        self._data, self._chunk, self._column = data, chunk, column
        self._kind = column.kind or ""
        self._dtype = FORMS[self._kind].dtype
        self._words: NDArray[Any] | list[str] | None = None

    def __iter__(self) -> Iterator[Column]:
        position, left = 0, self._chunk.values
        while left > 0:
            header, begin = decode(self._data, position)
            kind, stored = header.get(_KIND), header.get(_STORED, -1)
            position = begin + stored
            if not begin <= position <= len(self._data):
                raise ValueError(f"a page declares {stored} bytes")
            body = self._data[begin:position]
            if _CRC in header and zlib.crc32(body) != header[_CRC] & 0xFFFFFFFF:
                raise ValueError("the checksum of a page is wrong")
            if kind == DICTIONARY_PAGE:
                self._words = self._dictionary(header, body)
            elif kind == DATA_PAGE:
                values = self._page(header, body, left)
                left -= len(values)
                yield values
            elif kind != INDEX_PAGE:
                raise ForeignFormError(f"a page is of kind {kind}")

    def _dictionary(self, header: Struct, body: memoryview) -> NDArray[Any] | list[str]:
        about = header.get(_DICTIONARY, {})
        words = about.get(_VALUES, -1)
        if self._words is not None or about.get(_ENCODING) not in (PLAIN, PLAIN_DICTIONARY):
            raise ValueError("a column has two dictionaries, or one of an unknown encoding")
        # The words of categories are in every row group, also in one that has fewer rows.
        if not 0 <= words <= max(self._chunk.values, _WORDS_MAX):
            raise ValueError(f"a dictionary declares {words} words")
        return self._plain(self._uncompressed(header, body, words), words)

    def _page(self, header: Struct, body: memoryview, left: int) -> Column:
        about = header.get(_DATA, {})
        values = about.get(_VALUES, -1)
        if not 0 <= values <= left:
            raise ValueError(f"a page declares {values} values of {left}")
        if {about.get(_LEVELS), about.get(_REPETITIONS)} - {RLE, BIT_PACKED}:
            raise ValueError("a page declares an unknown encoding of its levels")
        data = self._uncompressed(header, body, values)
        known = None
        if self._column.optional:
            size = int.from_bytes(data[:4], "little")
            if about[_LEVELS] != RLE or size > len(data) - 4:
                raise ValueError(f"a page declares levels of {size} bytes")
            known = decode_runs(data[4 : 4 + size], 1, values) != 0
            data = data[4 + size :]
        count = values if known is None else int(np.count_nonzero(known))
        column = self._encoded(about.get(_ENCODING), data, count)
        return column if known is None or count == values else _spread(column, known)

    def _encoded(self, encoding: int | None, data: memoryview, count: int) -> Column:
        if encoding == PLAIN:
            plain = self._plain(data, count)
            return Text.of(plain) if isinstance(plain, list) else plain
        if encoding not in (PLAIN_DICTIONARY, RLE_DICTIONARY):
            raise ForeignFormError(f"a page declares encoding {encoding}")
        if self._words is None:
            raise ValueError(f"a page declares encoding {encoding}, without a dictionary")
        codes = decode_runs(data[1:], data[0] if data else 33, count) if count else np.empty(0, np.uint32)
        if count and codes.max() >= len(self._words):
            raise ValueError(f"a page has a word that is not among {len(self._words)}")
        if isinstance(self._words, list):
            return Text.of(self._words, codes.astype(np.int32))
        return self._words[codes]

    def _plain(self, data: memoryview, count: int) -> NDArray[Any] | list[str]:
        if self._kind == STRING:
            return _words_of(data, count)
        if self._kind == "bool":
            if 8 * len(data) < count:
                raise ValueError("a page is cut")
            return np.unpackbits(np.frombuffer(data, np.uint8), count=count, bitorder="little").view(np.bool_)
        values = np.frombuffer(data, self._dtype, count) if count else np.empty(0, self._dtype)
        return np.require(values, self._kind, "A")

    def _uncompressed(self, header: Struct, body: memoryview, values: int) -> memoryview:
        """The page; of numbers it has at most so many bytes as any encoding of them."""
        size = header.get(_SIZE, -1)
        limit = _TEXT_BYTES_MAX if self._kind == STRING else 64 + 16 * values
        if not 0 <= size <= min(limit, max(len(body), 64 + _LZ4_RATIO_MAX * len(body))):
            raise ValueError(f"a page declares {size} bytes, compressed {len(body)}")
        if self._chunk.codec == UNCOMPRESSED:
            if size != len(body):
                raise ValueError(f"an uncompressed page declares {size} and {len(body)} bytes")
            return body
        try:
            data = lz4.block.decompress(body, uncompressed_size=size)
        except lz4.block.LZ4BlockError:
            raise ValueError("a page is damaged: it cannot be uncompressed") from None
        if len(data) != size:
            raise ValueError(f"a page has {len(data)} bytes, and declares {size}")
        return memoryview(data)


def _words_of(data: memoryview, count: int) -> list[str]:
    if 4 * count > len(data):
        raise ValueError("a page is cut")
    words, position, letters = [], 0, bytes(data)
    for _ in range(count):
        begin = position + 4
        position = begin + int.from_bytes(letters[position:begin], "little")
        if position > len(letters):
            raise ValueError("a page is cut")
        words.append(letters[begin:position].decode())
    return words


def _spread(values: Column, known: NDArray[np.bool_]) -> Column:
    """The values in the rows that have one."""
    if isinstance(values, Text):
        codes = np.full(len(known), len(values.words), dtype=np.int32)
        codes[known] = values.at
        return Text.of([*values.words, ""], codes)
    if values.dtype == np.bool_:
        spread: NDArray[Any] = np.zeros(len(known), dtype=np.bool_)
    else:
        spread = np.full(len(known), np.nan, dtype=values.dtype if values.dtype.kind == "f" else np.float64)
    spread[known] = values
    return spread


_GROUP_VALUES_MAX = 1 << 27  # 1 GiB of numbers


class ParquetFile:
    """A Parquet file to read.

    Parameters
    ----------
    content
        Its bytes, of which tables may contain parts, or a file that remains open as long as this is in use.

    Raises
    ------
    ValueError
        If its footer is damaged, or it is not Parquet; one sentence says why.
    OSError
        If it cannot be read.
    """

    def __init__(self, content: bytes | BinaryIO) -> None:
        self.content = content
        self.footer: Footer = read_footer(io.BytesIO(content) if isinstance(content, bytes) else content)

    @property
    def schema(self) -> Schema:
        """Of all columns, if none has nulls; errors as of `table`."""
        return self.footer.schema_of(self.footer.columns)

    def table(self, groups: Sequence[int] | None = None, columns: Sequence[str] | None = None) -> Table:
        """The rows of these row groups with these columns.

        Raises
        ------
        ValueError
            If they are damaged, or of a form that is not read; one sentence says why.
        TypeError
            If a column contains neither numbers, truth values nor text.
        KeyError
            If there is no column of this name.
        OSError
            If they cannot be read.
        """
        chosen = self.footer.columns if columns is None else [self._named(name) for name in columns]
        schema = self.footer.schema_of(chosen)
        every = range(len(self.footer.groups)) if groups is None else groups
        values = tuple(self._column(column, every) for column in chosen)
        return Table(Schema(tuple(map(_as_found, schema, values)), schema.metadata), values)

    def tables(self, rows: int, groups: Sequence[int] | None = None) -> Iterator[Table]:
        """The rows of these row groups, at most so many at a time; errors as of `table`."""
        for group in range(len(self.footer.groups)) if groups is None else groups:
            table = self.table([group])
            for begin in range(0, table.num_rows, rows):
                yield table.slice(begin, rows)

    def _named(self, name: str) -> ParquetColumn:
        named = next((column for column in self.footer.columns if column.name == name), None)
        if named is None:
            raise KeyError(name)
        return named

    def _column(self, column: ParquetColumn, groups: Sequence[int]) -> Column:
        filled = [group for group in groups if self.footer.groups[group].rows]
        if not filled:
            return Text((), np.empty(0, np.int32)) if column.kind == STRING else np.empty(0, column.kind)
        return joined((self._chunk(column, group) for group in filled), sum(self.footer.groups[g].rows for g in filled))

    def _chunk(self, column: ParquetColumn, group: int) -> Column:
        chunk = self.footer.chunk(group, column)
        if chunk.values * len(self.footer.columns) > _GROUP_VALUES_MAX:
            raise ValueError(f"a row group has {chunk.values} rows, more than a run writes")
        try:
            try:
                return column_of(self._bytes(chunk), chunk, column)
            except ForeignFormError as form:
                return _foreign_column(self.content, group, column.name, chunk.values, str(form))
        except ValueError as error:
            raise ValueError(f"column {column.name!r} is not read: {error}") from None

    def _bytes(self, chunk: ColumnChunk) -> memoryview:
        if isinstance(self.content, bytes):
            return memoryview(self.content)[chunk.begin : chunk.begin + chunk.stored_bytes]
        self.content.seek(chunk.begin)
        return memoryview(self.content.read(chunk.stored_bytes))


def _as_found(field: Field, column: Column) -> Field:
    """Integers with nulls are doubles now."""
    kind = STRING if isinstance(column, Text) else column.dtype.name
    return field if kind == field.kind else Field(field.name, kind, field.metadata)


def _foreign_column(content: bytes | BinaryIO, group: int, name: str, rows: int, form: str) -> Column:
    """The values of a column with so many rows in a form that livebode does not write, by PyArrow.

    Raises
    ------
    ValueError
        If PyArrow is not installed, or does not find a value for each row; it begins with `form`, a sentence.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError:
        raise ValueError(f"{form}, which needs PyArrow: install livebode[parquet]") from None
    source = io.BytesIO(content) if isinstance(content, bytes) else content
    try:
        file = pq.ParquetFile(source, page_checksum_verification=True)
        columns = Table.from_arrow(file.read_row_group(group, columns=[name], use_threads=False)).columns
    except (pa.ArrowException, OSError, TypeError) as error:
        raise ValueError(f"{form}, and PyArrow does not read it: {str(error).splitlines()[0]}") from None
    if len(columns) != 1 or len(columns[0]) != rows:
        raise ValueError(f"{form}, and has not one value for each row")
    return columns[0]
