"""ParquetWriter: a Parquet file group by group, as tables come."""

from __future__ import annotations

import io
from collections.abc import Collection, Sequence
from typing import BinaryIO

from arro3 import io as arrow_io

from livebode.tables.exchange import to_arrow
from livebode.tables.schema import Schema
from livebode.tables.table import Table
from livebode.tables.thrift import I64, LIST, STRUCT, Struct, Value, decode, encode

_MAGIC = b"PAR1"
_LENGTH_BYTES = 4
_ROWS, _GROUPS = 3, 4  # fields of FileMetaData in Parquet's parquet.thrift
_GROUP_COLUMNS, _GROUP_OFFSET, _GROUP_NUMBER = 1, 5, 7  # of RowGroup; the number is 16 bits long, and optional
_COLUMN_ABOUT, _COLUMN_INDEXES = 3, (4, 5, 6, 7)  # of ColumnChunk
_COMPRESSED_BYTES, _OFFSETS = 7, (9, 10, 11)  # of ColumnMetaData; the first data, index and dictionary page


class ParquetWriter:
    """Writes each table as one row group, with statistics, compressed by LZ4.

    arro3 writes files whole and cuts groups at equal numbers of rows. Here it writes each group as a file in memory,
    whose pages are appended to the file; the footer has the groups at their new places. Indexes of pages are omitted.

    Parameters
    ----------
    file
        Empty; it is not closed.
    schema
        Of all tables.
    repeating
        Columns whose values repeat: they have a dictionary.
    """

    def __init__(self, file: BinaryIO, schema: Schema, repeating: Collection[str] = ()) -> None:
        self._file, self._schema = file, schema
        self._repeating: dict[str | Sequence[str], bool] = dict.fromkeys(repeating, True)
        self._about: bytes | None = None
        self._groups: list[bytes] = []  # as bytes: a long file has thousands
        self._rows = 0
        self._end = len(_MAGIC)
        file.write(_MAGIC)

    def write(self, table: Table) -> None:
        """Append the rows as a row group; ValueError if their schema differs."""
        if table.schema != self._schema:
            raise ValueError("the table has another schema than the file")
        if not table.num_rows:
            return
        data = self._written(table)
        footer = _footer_of(data)
        (group,) = _groups_of(decode(footer))
        self._about = self._about or footer
        end = _end_of_pages(group)
        _move(group, self._end - len(_MAGIC))
        self._file.write(memoryview(data)[len(_MAGIC) : end])
        self._end += end - len(_MAGIC)
        self._groups.append(encode(group))
        self._rows += table.num_rows

    def close(self) -> None:
        """Write the footer."""
        about = self._about or _footer_of(self._written(Table.empty(self._schema)))
        footer = encode({**decode(about), _ROWS: Value(I64, self._rows), _GROUPS: Value(LIST, (STRUCT, self._groups))})
        self._file.write(footer + len(footer).to_bytes(_LENGTH_BYTES, "little") + _MAGIC)

    def _written(self, table: Table) -> bytes:
        sink = io.BytesIO()
        arrow_io.write_parquet(
            to_arrow(table),
            sink,
            compression="lz4_raw",
            dictionary_enabled=False,
            column_dictionary_enabled=self._repeating,
            key_value_metadata=dict(self._schema.metadata) or None,
            max_row_group_size=max(1, table.num_rows),
        )
        return sink.getvalue()


def _footer_of(data: bytes) -> bytes:
    end = len(data) - len(_MAGIC) - _LENGTH_BYTES
    return data[end - int.from_bytes(data[end : end + _LENGTH_BYTES], "little") : end]


def _groups_of(footer: Struct) -> list[Struct]:
    _, groups = footer[_GROUPS].value
    return list(groups)


def _columns_of(group: Struct) -> list[Struct]:
    _, columns = group[_GROUP_COLUMNS].value
    return list(columns)


def _end_of_pages(group: Struct) -> int:
    found = []
    for column in _columns_of(group):
        about = column[_COLUMN_ABOUT].value
        begin = min(about[field].value for field in _OFFSETS if field in about)
        found.append(begin + about[_COMPRESSED_BYTES].value)
    return int(max(found))


def _move(group: Struct, by: int) -> None:
    """The group is so many bytes later."""
    for column in _columns_of(group):
        for field in _COLUMN_INDEXES:
            column.pop(field, None)
        about = column[_COLUMN_ABOUT].value
        for field in _OFFSETS:
            if field in about:
                about[field] = Value(I64, about[field].value + by)
    group[_GROUP_OFFSET] = Value(I64, group[_GROUP_OFFSET].value + by)
    group.pop(_GROUP_NUMBER, None)
