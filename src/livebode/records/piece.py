"""Checksums of a table in one Parquet file: of each row group and of the end, so that damage loses few rows."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from livebode.core import Event, RecordError
from livebode.language import Message
from livebode.records.inside import open_read
from livebode.records.segments.damage import KIND
from livebode.records.table_file import ParquetPart, sha256_of_next
from livebode.tables import ParquetFile, Table

_verified: dict[tuple[object, ...], list[bool]] = {}


class StoredTable:
    """A table in one file, with the entries of run.json on its parts.

    Raises
    ------
    RecordError
        If these entries are not in the form of a run.
    """

    def __init__(self, run: Path, name: str, parts: Any, report: Callable[[Event], None]) -> None:
        self._run, self._name, self._report = run, name, report
        try:
            self._parts = [ParquetPart(int(p["rows"]), int(p["size_bytes"]), str(p["sha256"])) for p in parts]
            self._parts[-1]
        except (TypeError, LookupError, ValueError):
            raise RecordError(
                "unexpected-content",
                f"{str(run / 'run.json')!r} has invalid entries for the parts of {name}",
                "run the recording again",
                path=str(run / "run.json"),
                key=f"files.{name}",
            ) from None

    def groups(self) -> list[int]:
        """The numbers of the intact row groups. Damaged ones are reported.

        Raises
        ------
        OSError
            If the file cannot be opened.
        """
        with open_read(self._run, self._name) as file:
            whole = self._whole(file, self._parts)
        if not whole[-1]:
            self._report_of("its end is damaged, so it cannot be read", sum(part.rows for part in self._parts))
            return []
        begin = 0
        for part, sound in zip(self._parts, whole):
            if not sound:
                self._report_of(f"rows {begin} to {begin + part.rows - 1} are not read", part.rows)
            begin += part.rows
        return [number for number, sound in enumerate(whole[:-1]) if sound]

    def tables(self, rows: int) -> Iterator[Table]:
        """The intact rows, in parts of at most so many."""
        groups = self.groups()
        if groups == []:
            return
        with open_read(self._run, self._name) as file:
            yield from ParquetFile(file).tables(rows, groups)

    def _whole(self, file: BinaryIO, parts: list[ParquetPart]) -> list[bool]:
        """Whether each part is intact; computed once per process, as long as the file is unchanged."""
        status = os.fstat(file.fileno())
        key = (tuple(parts), status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
        if key not in _verified:
            sound = [sha256_of_next(file, part.size_bytes) == part.sha256 for part in parts]
            sound[-1] &= status.st_size == sum(part.size_bytes for part in parts)
            _verified[key] = sound
        return _verified[key]

    def _report_of(self, what: str, rows: int) -> None:
        table = self._name.removesuffix(".parquet")
        self._report(
            Event(
                KIND,
                0,
                0.0,
                Message("{file} is damaged: {what}", file=self._name, what=what),
                {"rows": {table: rows}},
            )
        )
