"""Parquet files: only the columns and row groups that are asked for, decoded by arro3.

arro3 reads whole files. It gets one with the bytes of this file and a footer that names only these columns and row
groups, and reads page by page what that footer names.

A damaged page can end the process: arro3 decodes behind a C interface, and a failed assertion of its decoder aborts
there. Headers of pages and checksums of pages, where a file has them, are checked before; for files without these
checksums the caller verifies the bytes first, as records do.
"""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import IO, BinaryIO, TypeVar, cast

from arro3 import core
from arro3 import io as arrow_io

from livebode.tables.exchange import from_arrow
from livebode.tables.parquet_footer import Footer, read_footer, written_footer
from livebode.tables.parquet_pages import check_pages
from livebode.tables.table import Table

_ARROW_SCHEMA = "ARROW:schema"
_END_OF_STREAM = b"\xff\xff\xff\xff\0\0\0\0"
_LIST_VALUES_MAX = 1 << 27  # in a row group: 1 GiB of numbers; the number of rows does not limit lists
_T = TypeVar("_T")


class ParquetFile:
    """A Parquet file that is open for reading, and remains open as long as this is in use.

    Raises
    ------
    ValueError
        If its footer is damaged, or it is not Parquet; one sentence says why.
    OSError
        If it cannot be read.
    """

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.footer: Footer = read_footer(file)

    @cached_property
    def schema(self) -> core.Schema:
        """Its schema; ValueError if arro3 does not read it."""
        return self._reader(range(len(self.footer.columns)), [], 1).schema

    def batches(
        self, columns: Sequence[int] | None = None, groups: Sequence[int] | None = None, rows: int = 1 << 16
    ) -> Iterator[core.RecordBatch]:
        """The rows of these row groups, at most `rows` at a time, with these columns in the order of the file.

        Raises
        ------
        ValueError
            If they are damaged, or of a kind that is not read; one sentence says why.
        OSError
            If they cannot be read.
        """
        places = range(len(self.footer.columns)) if columns is None else sorted(set(columns))
        for group in range(len(self.footer.groups)) if groups is None else groups:
            if not self.footer.groups[group].rows:
                continue
            self._check(places, group)
            reader = self._reader(places, [group], rows)
            while (batch := _contained(lambda: next(reader, None))) is not None:  # noqa: B023 (called at once)
                yield batch

    def table(self, groups: Sequence[int] | None = None) -> Table:
        """The rows of these row groups, as `batches`; TypeError if one of its columns cannot be in a table."""
        rows = max((group.rows for group in self.footer.groups), default=0)
        batches = list(self.batches(groups=groups, rows=rows))
        return from_arrow(core.Table.from_batches(batches, schema=batches[0].schema if batches else self.schema))

    def _check(self, places: Sequence[int], group: int) -> None:
        for column in (self.footer.columns[place] for place in places):
            for chunk in (self.footer.groups[group].chunks[leaf] for leaf in column.leaves):
                if column.repeated and chunk.values > _LIST_VALUES_MAX:
                    raise ValueError(f"column {column.name!r} has lists of {chunk.values} values in a row group")
                try:
                    check_pages(self.file, chunk)
                except ValueError as error:
                    raise ValueError(f"column {column.name!r} is damaged: {error}") from None

    def _reader(self, places: Sequence[int], groups: Sequence[int], rows: int) -> core.RecordBatchReader:
        metadata = dict(self.footer.metadata)
        if _ARROW_SCHEMA in metadata and len(places) < len(self.footer.columns):
            metadata[_ARROW_SCHEMA] = _contained(lambda: _narrowed(metadata[_ARROW_SCHEMA], places))
        end = written_footer(self.footer, places, groups, metadata)
        view = _OtherEnd(self.file, self.footer.begin, end)
        return _contained(lambda: arrow_io.read_parquet(cast(IO[bytes], view), batch_size=max(1, rows)))


class _OtherEnd(io.RawIOBase):
    """The bytes of a file up to `begin`, followed by others."""

    def __init__(self, file: BinaryIO, begin: int, end: bytes) -> None:
        super().__init__()
        self._file, self._begin, self._end, self._at = file, begin, end, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        origin = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._begin + len(self._end)}
        self._at = origin[whence] + offset
        return self._at

    def tell(self) -> int:
        return self._at

    def read(self, size: int = -1) -> bytes:
        if self._at < self._begin:
            self._file.seek(self._at)
            data = self._file.read(min(size, self._begin - self._at))
        else:
            first = self._at - self._begin
            data = self._end[first : first + size]
        self._at += len(data)
        return data


def _narrowed(encoded: str, places: Sequence[int]) -> str:
    """Arrow's schema in the metadata, as of only these columns."""
    whole = arrow_io.read_ipc_stream(io.BytesIO(base64.b64decode(encoded) + _END_OF_STREAM)).schema
    schema = core.Schema([whole.field(place) for place in places], metadata=whole.metadata)
    sink = io.BytesIO()
    arrow_io.write_ipc_stream(core.Table.from_batches([], schema=schema), sink)
    return base64.b64encode(sink.getvalue().removesuffix(_END_OF_STREAM)).decode()


def _contained(action: Callable[[], _T]) -> _T:
    """Its result; any error of arro3 as a ValueError of one sentence."""
    try:
        return action()
    except (OSError, MemoryError):
        raise
    except Exception as error:
        raise ValueError(_first_line(error)) from None
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # of pyo3; it has no module from which it could be imported
            raise
        raise ValueError(_first_line(error)) from None


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
