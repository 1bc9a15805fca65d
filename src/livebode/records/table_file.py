"""Layout of a table, and a table as one Parquet file, readable with any tool."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

_GROUP_ROWS = 1 << 18


@dataclass(frozen=True)
class ColumnTable:
    """The columns of a table, with ``sample`` (int64) and ``time_s`` among them.

    `repeating` names those whose values repeat over lines or rows: they compress by a dictionary; measured ones never
    do.
    """

    schema: pa.Schema
    repeating: tuple[str, ...] = ()


class TableFile:
    """Appends rows of a Table to a Parquet file, by row groups of bounded size."""

    def __init__(self, path: Path, table: ColumnTable) -> None:
        self._schema = table.schema
        self._file = pq.ParquetWriter(path, table.schema, use_dictionary=list(table.repeating), compression="lz4")
        self._waiting: list[pa.RecordBatch] = []
        self._rows = 0

    def write(self, rows: pa.RecordBatch) -> None:
        if not rows.num_rows:
            return
        self._waiting.append(rows)
        self._rows += rows.num_rows
        if self._rows >= _GROUP_ROWS:
            self._flush()

    def close(self) -> None:
        self._flush()
        self._file.close()

    def _flush(self) -> None:
        waiting, rows = self._waiting, self._rows
        self._waiting, self._rows = [], 0  # first, so that `close` does not write rows again after a disk error
        if waiting:
            # One group, so that it ends with a complete response: a damaged one is skipped without cutting the next.
            self._file.write_table(pa.Table.from_batches(waiting, self._schema), row_group_size=rows)
