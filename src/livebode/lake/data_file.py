"""DataFile: a Parquet file of one result, whose name and bytes follow from the result alone."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from livebode.arrow import text
from livebode.lake.schemas import TABLES
from livebode.records.wide_responses import wide_options

JOINED = "part-"
"""Begin of the names that Delta gives to joined files."""
_GROUP_BYTES = 4 << 20


class Key(NamedTuple):
    """What a result belongs to: the recording by its content, and the settings by the recipe's id."""

    content: str
    recipe: str


@dataclass(frozen=True)
class DataFile:
    """A file in the directory of a table, not yet in the table.

    Attributes
    ----------
    table
        Name of the table.
    name
        Of the file; the same result has the same one.
    size_bytes, rows
        For the table's log.
    key
        The result that it contains; None if there are several.
    """

    table: str
    name: str
    size_bytes: int
    rows: int
    key: Key | None = None

    @property
    def statistics(self) -> str:
        """Statistics in Delta's form.

        Without limits: deltalake reads a column whose limits are missing as one between null and null, so a filter on
        it finds no row as soon as another column has limits. The limits in the Parquet file itself are used.
        """
        return json.dumps({"numRecords": self.rows})


class DataFileWriter:
    """Writes the rows of one result, as they come, to a file in this directory. A context manager.

    Row groups have a bounded size, and follow from the rows alone.

    Parameters
    ----------
    folder
        An existing directory.
    table
        Of the lake.
    key
        The result; its columns are added to the rows.
    """

    def __init__(self, folder: Path, table: str, key: Key) -> None:
        self._path, self._table, self._key = folder / f"{key.content}-{key.recipe}.parquet", table, key
        self._schema = TABLES[table].schema
        self._writer = parquet_writer(self._path, self._schema)
        self._waiting: list[pa.Table] = []
        self._waiting_bytes = self._rows = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._writer.close()

    def write(self, rows: pa.Table) -> None:
        """Append rows without the key's columns; a column that they lack is null."""
        own = [text([word], np.zeros(rows.num_rows, dtype=np.int64)) for word in self._key]
        columns = [_column(rows, self._schema.field(name)) for name in self._schema.names[len(own) :]]
        self._waiting.append(pa.table([*own, *columns], schema=self._schema))
        self._rows += rows.num_rows
        self._waiting_bytes += rows.nbytes
        if self._waiting_bytes >= _GROUP_BYTES:
            self._flush()

    def finish(self) -> DataFile:
        """Complete the file."""
        self._flush()
        self._writer.close()
        return DataFile(self._table, self._path.name, self._path.stat().st_size, self._rows, self._key)

    def _flush(self) -> None:
        if self._waiting:
            whole = pa.concat_tables(self._waiting)
            self._waiting, self._waiting_bytes = [], 0
            self._writer.write_table(whole, row_group_size=max(whole.num_rows, 1))


def _column(rows: pa.Table, field: pa.Field[Any]) -> Any:
    if field.name in rows.column_names:
        return rows[field.name].cast(field.type)
    return pa.nulls(rows.num_rows, field.type)


def write_data_file(folder: Path, table: str, key: Key, parts: Iterable[pa.Table]) -> DataFile:
    """Write the rows of one result, without the key's columns, to a file in this directory; none if it has no rows."""
    with DataFileWriter(folder, table, key) as writer:
        for part in parts:
            writer.write(part)
        return writer.finish()


def parquet_writer(path: Path | pa.BufferOutputStream, schema: pa.Schema) -> pq.ParquetWriter:
    """A Parquet file with the layout of wide responses, without Arrow's own schema: a lake has one for all files."""
    return pq.ParquetWriter(path, schema, store_schema=False, **wide_options(schema))
