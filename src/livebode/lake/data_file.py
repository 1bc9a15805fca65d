"""DataFile: a Parquet file of one result, whose name and bytes follow from the result alone."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from livebode.lake.schemas import TABLES
from livebode.records.wide_responses import wide_options

JOINED = "part-"
"""Begin of the names that Delta gives to joined files."""


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


def write_data_file(folder: Path, table: str, key: Key, parts: Iterable[pa.Table]) -> DataFile:
    """Write the rows of one result, without the key's columns, to a file in this directory; none if it has no rows."""
    path = folder / f"{key.content}-{key.recipe}.parquet"
    schema, rows = TABLES[table].schema, 0
    with parquet_writer(path, schema) as writer:
        for part in parts:
            own = [pa.repeat(pa.scalar(text, pa.string()), part.num_rows) for text in key]
            columns = [*own, *(part[name].cast(schema.field(name).type) for name in schema.names[len(key) :])]
            writer.write_table(pa.table(columns, schema=schema))
            rows += part.num_rows
    return DataFile(table, path.name, path.stat().st_size, rows, key)


def parquet_writer(path: Path | pa.BufferOutputStream, schema: pa.Schema) -> pq.ParquetWriter:
    """A Parquet file with the layout of wide responses, without Arrow's own schema: a lake has one for all files."""
    return pq.ParquetWriter(path, schema, store_schema=False, **wide_options(schema))
