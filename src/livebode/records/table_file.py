"""Layout of a table, and a table as one Parquet file, readable with any tool, with a checksum of each part."""

from __future__ import annotations

import contextlib
import hashlib
import os
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, BinaryIO

from livebode.tables import ParquetWriter, Schema, Table

_GROUP_ROWS = 1 << 15  # two groups at a time are in memory: one fills, one is written
_BLOCK = 1 << 20


@dataclass(frozen=True)
class ParquetPart:
    """Consecutive bytes of a Parquet file: a row group, or, with no rows, the bytes after the last one."""

    rows: int
    size_bytes: int
    sha256: str


def sha256_of_next(file: BinaryIO, size: int) -> str:
    """The checksum of the next `size` bytes, in hexadecimal form."""
    found = hashlib.sha256()
    while size > 0 and (block := file.read(min(size, _BLOCK))):
        found.update(block)
        size -= len(block)
    return found.hexdigest()


@dataclass(frozen=True)
class ColumnTable:
    """The columns of a table, with ``sample`` (int64) and ``time_s`` among them.

    `repeating` names those whose values repeat over lines or rows: they compress by a dictionary; measured ones never
    do.
    """

    schema: Schema
    repeating: tuple[str, ...] = ()


class TableFile:
    """Appends rows of a Table to a Parquet file, by row groups of bounded size, with the checksum of each.

    A thread encodes, writes and reads back a group while the next one fills; the error of a group is raised by the next
    call.

    Parameters
    ----------
    path
        The file; it must not exist.
    table
        Its columns.

    Raises
    ------
    OSError
        If the file cannot be written.
    """

    def __init__(self, path: Path, table: ColumnTable) -> None:
        self._path = path
        self._file = path.open("wb")
        self._writer = ParquetWriter(self._file, table.schema, table.repeating)
        self._waiting: list[Table] = []
        self._rows = 0
        self._parts: list[ParquetPart] = []
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="table")
        self._group: Future[None] | None = None

    def write(self, rows: Table) -> None:
        if not rows.num_rows:
            return
        self._waiting.append(rows)
        self._rows += rows.num_rows
        if self._rows >= _GROUP_ROWS:
            self._flush()

    def close(self) -> list[dict[str, Any]]:
        """Complete the file, and return its parts, for run.json; again: the same."""
        if not self._file.closed:
            with contextlib.ExitStack() as ends:
                ends.callback(self._thread.shutdown)
                ends.callback(self._file.close)
                self._flush()
                self._await_group()
                self._writer.close()
            self._add_part(0)
        return [asdict(part) for part in self._parts]

    def _flush(self) -> None:
        waiting, rows = self._waiting, self._rows
        self._waiting, self._rows = [], 0  # first, so that `close` does not write rows again after a disk error
        if waiting:
            self._await_group()
            self._group = self._thread.submit(self._write, waiting, rows)

    def _await_group(self) -> None:
        group, self._group = self._group, None
        if group is not None:
            group.result()

    def _write(self, waiting: list[Table], rows: int) -> None:
        # One group, so that it ends with a complete response: a damaged one is skipped without cutting the next.
        self._writer.write(Table.join(waiting))
        self._file.flush()
        self._add_part(rows)

    def _add_part(self, rows: int) -> None:
        """The bytes since the last part, as they are in the file."""
        with self._path.open("rb") as file:
            file.seek(sum(part.size_bytes for part in self._parts))
            size = os.fstat(file.fileno()).st_size - file.tell()
            self._parts.append(ParquetPart(rows, size, sha256_of_next(file, size)))
