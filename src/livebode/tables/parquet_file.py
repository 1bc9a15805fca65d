"""Parquet files of runs: only the columns and row groups that are asked for.

Plain flat columns, compressed by LZ4 or not at all: what livebode writes, and wrote with PyArrow before. Columns that
another program wrote in another form are read by PyArrow where it is installed. A value that a file does not have is
NaN.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from livebode.tables.parquet_footer import ColumnChunk, Footer, ParquetColumn, read_footer
from livebode.tables.parquet_pages import ForeignFormError, column_of, joined
from livebode.tables.table import STRING, Column, Field, Schema, Table, Text

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
        found = next((one for one in self.footer.columns if one.name == name), None)
        if found is None:
            raise KeyError(name)
        return found

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
        found = Table.from_arrow(file.read_row_group(group, columns=[name], use_threads=False)).columns
    except (pa.ArrowException, OSError, TypeError) as error:
        raise ValueError(f"{form}, and PyArrow does not read it: {str(error).splitlines()[0]}") from None
    if len(found) != 1 or len(found[0]) != rows:
        raise ValueError(f"{form}, and has not one value for each row")
    return found[0]
