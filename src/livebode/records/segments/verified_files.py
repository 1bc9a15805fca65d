"""The segments of a table as data sets of Arrow: a file is opened, and its checksum computed, when a query needs it."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from livebode.core import Event, needing
from livebode.dataclass import dataclass
from livebode.records.segments import reading
from livebode.records.segments.manifest import Segment
from livebode.tables import ParquetFile

with needing("PyArrow", "query", "a query"):
    import pyarrow as pa
    import pyarrow.dataset as ds
    import pyarrow.parquet as pq
    from pyarrow.fs import FileInfo, FileSystemHandler, FileType, PyFileSystem

_GROUPS_MAX = 16  # DuckDB needs some milliseconds to plan each


@dataclass(frozen=True)
class SegmentGroup:
    """Consecutive segments, and the times of their first and last row."""

    rows: ds.Dataset
    first_s: float
    last_s: float


def segment_groups(run: Path, segments: list[Segment], damages: list[Event]) -> list[SegmentGroup]:
    """The segments of one table, by age, in at most 16 groups; none if all are damaged.

    A query that excludes the times of a group opens none of its files. Damage that is found while a data set is read
    is appended to `damages`, and the damaged file has no rows.

    Raises
    ------
    OSError
        If a file cannot be read.
    """
    schema = _schema(run, segments, damages)
    if schema is None:
        return []
    named = {segment.name: segment for segment in segments}

    def opened(name: str) -> pa.NativeFile | None:
        file = reading.intact_file(run, named[name], damages.append)
        if file is None:
            return None
        with file:
            return pa.PythonFile(_OwnedFile(os.dup(file.fileno())), "r")

    files = PyFileSystem(VerifiedFiles(schema, opened))
    parquet = ds.ParquetFileFormat()
    size = -(-len(segments) // _GROUPS_MAX)
    groups = []
    for begin in range(0, len(segments), size):
        part = segments[begin : begin + size]
        pieces = [parquet.make_fragment(segment.name, files, partition_expression=_within(segment)) for segment in part]
        rows = ds.FileSystemDataset(pieces, schema, parquet, files)
        groups.append(
            SegmentGroup(rows, min(segment.first_s for segment in part), max(segment.last_s for segment in part))
        )
    return groups


def _schema(run: Path, segments: list[Segment], damages: list[Event]) -> pa.Schema | None:
    """The columns of the first segment that is not damaged; None if all are."""
    for segment in segments:
        file = reading.intact_file(run, segment, damages.append)
        if file is not None:
            with file:
                return pa.schema(ParquetFile(file).schema)
    return None


def _within(segment: Segment) -> ds.Expression:
    sample, time_s = ds.field("sample"), ds.field("time_s")
    of_samples = (sample >= segment.first_sample) & (sample <= segment.last_sample)
    return of_samples & (time_s >= segment.first_s) & (time_s <= segment.last_s)


class _OwnedFile(io.FileIO):
    """A file that is closed with the last reference to it, without a warning, because Arrow closes none."""

    def __del__(self) -> None:
        self.close()


class VerifiedFiles(FileSystemHandler):  # type: ignore[misc]
    """Reads Parquet files with these columns, and nothing else.

    Parameters
    ----------
    schema
        Columns of all files.
    opened
        A file, which was compared with its checksum; None if it is damaged, and has no rows.
    """

    def __init__(self, schema: pa.Schema, opened: Callable[[str], pa.NativeFile | None]) -> None:
        self._schema, self._opened = schema, opened

    def __eq__(self, other: object) -> bool:
        return self is other

    def __ne__(self, other: object) -> bool:
        return self is not other

    def open_input_file(self, path: str) -> pa.NativeFile:
        """A file; no rows if it is damaged."""
        if (file := self._opened(path)) is not None:
            return file
        sink = pa.BufferOutputStream()
        pq.write_table(self._schema.empty_table(), sink)
        return pa.BufferReader(sink.getvalue())

    def open_input_stream(self, path: str) -> pa.NativeFile:
        return self.open_input_file(path)

    def normalize_path(self, path: str) -> str:
        return path

    def get_type_name(self) -> str:
        return "verified files"

    def get_file_info(self, paths: list[str]) -> list[FileInfo]:
        return [FileInfo(path, FileType.File) for path in paths]

    def _unsupported(self, *_: Any) -> NoReturn:
        raise NotImplementedError

    get_file_info_selector = create_dir = delete_dir = delete_dir_contents = delete_root_dir_contents = _unsupported
    delete_file = move = copy_file = open_output_stream = open_append_stream = _unsupported
