"""The pages of a column in a Parquet file: their headers are checked before anything is decoded.

The decoder trusts sizes and kinds of pages more than a damaged file deserves.
"""

from __future__ import annotations

import zlib
from typing import BinaryIO

from livebode.tables.parquet_footer import ColumnChunk
from livebode.tables.thrift_compact import I32, STRUCT, CompactReader

_PAGE_BYTES_MAX = 1 << 30
_HEADER_BYTES, _HEADER_BYTES_MAX = 1 << 9, 1 << 20
_BLOCK = 1 << 20
_DATA, _INDEX, _DICTIONARY, _DATA_V2 = range(4)
_HEADER_OF = {_DATA: 5, _INDEX: 6, _DICTIONARY: 7, _DATA_V2: 8}  # fields of PageHeader
_PLAIN, _PLAIN_DICTIONARY, _RLE, _BIT_PACKED, _RLE_DICTIONARY = 0, 2, 3, 4, 8
_BOOLEAN, _INT32, _INT64, _INT96, _FLOAT, _DOUBLE, _BYTES, _FIXED_BYTES = range(8)
_TYPES_OF = {  # of the encodings of data pages
    _PLAIN: range(8),
    _PLAIN_DICTIONARY: range(1, 8),
    _RLE: [_BOOLEAN],
    5: [_INT32, _INT64],  # DELTA_BINARY_PACKED
    6: [_BYTES],  # DELTA_LENGTH_BYTE_ARRAY
    7: [_BYTES, _FIXED_BYTES],  # DELTA_BYTE_ARRAY
    _RLE_DICTIONARY: range(1, 8),
    9: [_INT32, _INT64, _FLOAT, _DOUBLE, _FIXED_BYTES],  # BYTE_STREAM_SPLIT
}
_UNCOMPRESSED = 0


def check_pages(file: BinaryIO, chunk: ColumnChunk) -> None:
    """Check the headers of all pages of the column, and the checksums of those that have one.

    Raises
    ------
    ValueError
        If a header contradicts the footer or itself, or a checksum is wrong.
    """
    at, end = chunk.begin, chunk.begin + chunk.compressed_bytes
    values, dictionary = 0, False
    while at < end and values < chunk.values:
        header, begin = _header(file, at, end)
        kind, size, stored = header.get(1, -1), header.get(2, -1), header.get(3, -1)
        at = begin + stored
        if kind not in _HEADER_OF or not (0 <= size <= _PAGE_BYTES_MAX and stored >= 0 and at <= end):
            raise ValueError(f"a page declares {stored} bytes, uncompressed {size}, at byte {begin}")
        if chunk.codec == _UNCOMPRESSED and size != stored:
            raise ValueError(f"an uncompressed page declares {size} and {stored} bytes")
        if kind == _DICTIONARY:
            if dictionary or values or begin > chunk.data_begin:
                raise ValueError("a dictionary is not at the beginning of a column")
            _check_dictionary(header, size)
            dictionary = True
        elif kind != _INDEX:
            values += _values_of(header, kind, size, chunk, dictionary)
        if 4 in header:
            _check_sum(file, begin, stored, header[4])
    if values != chunk.values:
        raise ValueError(f"the pages of a column have {values} values, its footer declares {chunk.values}")


def _header(file: BinaryIO, at: int, end: int) -> tuple[dict[int, int], int]:
    """The numbers of a page header by their fields, those of the inner struct times 100, and the byte after it."""
    for size in (_HEADER_BYTES, _HEADER_BYTES_MAX):  # statistics can make it long
        file.seek(at)
        reader = CompactReader(file.read(min(size, end - at)))
        try:
            return _parsed(reader), at + reader.at
        except ValueError as error:
            wrong = error
    raise ValueError(f"the page header at byte {at} is damaged: {wrong}")


def _parsed(reader: CompactReader) -> dict[int, int]:
    found: dict[int, int] = {}
    for number, kind in reader.fields():
        if number < 5 and kind == I32:
            found[number] = reader.integer()
        elif number in _HEADER_OF.values() and kind == STRUCT:
            for inner, inner_kind in reader.fields():
                if inner_kind == I32:
                    found[100 * number + inner] = reader.integer()
                else:
                    reader.skip(inner_kind)
        else:
            reader.skip(kind)
    return found


def _check_dictionary(header: dict[int, int], size: int) -> None:
    words, encoding = header.get(701, -1), header.get(702, -1)
    if not 0 <= words <= size or encoding not in (_PLAIN, _PLAIN_DICTIONARY):
        raise ValueError(f"a dictionary of {size} bytes declares {words} words in encoding {encoding}")


def _values_of(header: dict[int, int], kind: int, size: int, chunk: ColumnChunk, dictionary: bool) -> int:
    field = 100 * _HEADER_OF[kind]
    values, encoding = header.get(field + 1, -1), header.get(field + (4 if kind == _DATA_V2 else 2), -1)
    if not 0 <= values <= chunk.values:
        raise ValueError(f"a page declares {values} values of {chunk.values}")
    if chunk.physical_type not in _TYPES_OF.get(encoding, ()):
        raise ValueError(f"a page of type {chunk.physical_type} declares encoding {encoding}")
    if encoding in (_PLAIN_DICTIONARY, _RLE_DICTIONARY) and not dictionary:
        raise ValueError("a page needs a dictionary, which the column does not have")
    if kind == _DATA_V2:
        nulls, rows, levels = header.get(802, -1), header.get(803, -1), (header.get(805, -1), header.get(806, -1))
        if not (0 <= nulls <= values and 0 <= rows <= values and min(levels) >= 0 and sum(levels) <= size):
            raise ValueError(
                f"a page declares {values} values, {nulls} nulls, {rows} rows and levels of {levels} bytes"
            )
    elif not {header.get(field + 3), header.get(field + 4)} <= {_RLE, _BIT_PACKED}:
        raise ValueError("a page declares an unknown encoding of its levels")
    return values


def _check_sum(file: BinaryIO, begin: int, size: int, expected: int) -> None:
    file.seek(begin)
    found = 0
    while size > 0 and (block := file.read(min(size, _BLOCK))):
        found = zlib.crc32(block, found)
        size -= len(block)
    if found != expected & 0xFFFFFFFF:
        raise ValueError(f"the checksum of the page at byte {begin} is wrong")
