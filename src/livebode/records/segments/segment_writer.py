"""Segments as Parquet files, readable with any tool, with a checksum of each row group."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Collection, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import BinaryIO

from livebode.records.column_table import ColumnTable
from livebode.records.segments.manifest import Segment, SegmentPart
from livebode.tables import ParquetWriter, Schema, Table

GROUP_ROWS = 1 << 15
"""Rows after which a row group ends, with the table that reaches them: a damaged group costs whole responses."""


class SegmentWriter:
    """Writes tables as the row groups of a segment.

    Parameters
    ----------
    file
        An empty file; it is not closed.
    schema, repeating
        As of a `ColumnTable`.
    """

    def __init__(self, file: BinaryIO, schema: Schema, repeating: Collection[str] = ()) -> None:
        self._file = _DigestedFile(file)
        self._writer = ParquetWriter(self._file, schema, repeating)
        self._parts: list[SegmentPart] = []
        self._samples: list[int] = []
        self._times_s: list[float] = []

    def write(self, rows: Table) -> None:
        """Append the rows as one row group; ValueError if their schema differs, OSError if the disk fails."""
        if not rows.num_rows:
            return
        self._writer.write(rows)
        self._parts.append(self._file.part(rows.num_rows))
        for extent, values in (self._samples, rows["sample"]), (self._times_s, rows["time_s"]):
            extent += [values.min().item(), values.max().item()]

    def close(self, name: str, table: str) -> Segment:
        """Write the end of the file; the segment with this path in the directory of the run, for the manifest."""
        self._writer.close()
        self._parts.append(self._file.part(0))
        return Segment(
            name=name,
            table=table,
            first_sample=min(self._samples, default=0),
            last_sample=max(self._samples, default=0),
            first_s=min(self._times_s, default=0.0),
            last_s=max(self._times_s, default=0.0),
            parts=tuple(self._parts),
        )


class _DigestedFile:
    """A file that computes the checksums of its parts while they are written."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._sha256, self._size_bytes = hashlib.sha256(), 0

    def write(self, data: bytes | memoryview) -> int:
        self._sha256.update(data)
        self._size_bytes += len(data)
        return self._file.write(data)

    def writelines(self, lines: Iterable[bytes | memoryview]) -> None:
        for line in lines:
            self.write(line)

    def part(self, rows: int) -> SegmentPart:
        """The bytes since the previous part."""
        part = SegmentPart(rows, self._size_bytes, self._sha256.hexdigest())
        self._sha256, self._size_bytes = hashlib.sha256(), 0
        return part


class TableFile:
    """The file of a table that is one segment: appends rows, by row groups of bounded size.

    A thread encodes and writes a group while the next one fills; the error of a group is raised by the next call.

    Parameters
    ----------
    path
        The file, with the name of the table; it must not exist.
    table
        Its columns.

    Raises
    ------
    OSError
        If the file cannot be written.
    """

    def __init__(self, path: Path, table: ColumnTable) -> None:
        self._path, self._schema = path, table.of_recording
        self._file = path.open("wb")
        self._writer = SegmentWriter(self._file, self._schema, table.repeating)
        self._waiting: list[Table] = []
        self._rows = 0
        self._segment: Segment | None = None
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="table")
        self._group: Future[None] | None = None

    def write(self, rows: Table) -> None:
        if not rows.num_rows:
            return
        self._waiting.append(rows)
        self._rows += rows.num_rows
        if self._rows >= GROUP_ROWS:
            self._flush()

    def close(self) -> Segment:
        """Complete the file, and return its segment, for the manifest; again: the same."""
        if self._segment is None:
            with contextlib.ExitStack() as ends:
                ends.callback(self._thread.shutdown)
                ends.callback(self._file.close)
                self._flush()
                self._await_group()
                self._segment = self._writer.close(self._path.name, self._path.stem)
        return self._segment

    def _flush(self) -> None:
        waiting, rows = self._waiting, self._rows
        self._waiting, self._rows = [], 0  # first, so that `close` does not write rows again after a disk error
        if rows:
            self._await_group()
            self._group = self._thread.submit(self._write, waiting)

    def _await_group(self) -> None:
        group, self._group = self._group, None
        if group is not None:
            group.result()

    def _write(self, waiting: list[Table]) -> None:
        # One group, so that it ends with a complete response: a damaged one is skipped without cutting the next.
        self._writer.write(Table.join(waiting, self._schema))
        self._file.flush()
