"""CSV, TSV and similar: detected by `dialect`, read in pieces by `rows`, errors located by `locate`."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from livebode.core import RecordingError
from livebode.sources.cells import CellKind
from livebode.sources.dialect import Dialect, find_dialect
from livebode.sources.locate import locate
from livebode.sources.recording import Chunk, Column, Recording, Skipped
from livebode.sources.rows import ROW_BYTES_MAX, RowError, RowReader
from livebode.sources.tidy import Tidied
from livebode.sources.timing import time_rank
from livebode.sources.units import SECONDS, split_units
from livebode.sources.whole_lines import whole_lines

_PIECE_BYTES = 4 << 20


class DelimitedRecording(Recording):
    """A table in a text file. Its length is known only after reading."""

    format: ClassVar[str] = "csv"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._dialect = self.find_dialect(path)
        columns: list[Column] = []
        skipped: list[Skipped] = []
        headings = self._dialect.headings
        for at, ((name, unit), kind) in enumerate(zip(split_units(headings), self._dialect.kinds, strict=True)):
            unit = self._dialect.units[at] or unit
            aliases = (headings[at],) if headings[at] != name else ()
            if kind in (CellKind.NUMBER, CellKind.MOMENT):
                is_moment = kind is CellKind.MOMENT
                columns.append(Column(name, "ns" if is_moment else unit, None, aliases, temporal=is_moment, key=at))
            elif headings[at]:
                skipped.append(Skipped(name, "it contains text"))
        self.columns, self.skipped = tuple(columns), tuple(skipped)
        if self._dialect.period_s:
            self.scalars = {"dt": self._dialect.period_s}
        if columns and columns[0].unit.casefold() in SECONDS and all(time_rank(column) is None for column in columns):
            # The time of an oscilloscope: "x-axis", "X" or "Source", above "second".
            self.columns = (replace(columns[0], clock=True), *columns[1:])

    def find_dialect(self, path: Path) -> Dialect:
        """Layout of the table; a format that declares its own replaces this."""
        return find_dialect(path)

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        del rows
        keys = [column.key for column in columns]
        try:
            with self._opened() as file:
                reader = RowReader(self._dialect, keys, "utf-8" if self._needs_tidying else self._dialect.encoding)
                for piece in whole_lines(file, _PIECE_BYTES):
                    yield from reader.read(piece)
        except RowError as error:
            raise locate(self.path, self._dialect, list(dict.fromkeys(keys)), ROW_BYTES_MAX) or RecordingError(
                "damaged", f"cannot read {self.path}: {error}", "repair the file", path=str(self.path)
            ) from error

    def parsed(self, lines: bytes, columns: Sequence[Column]) -> Chunk:
        """The values of `columns` in whole lines of the table; RecordingError where one of them does not fit it."""
        reader = RowReader(self._dialect, [column.key for column in columns], "utf-8")
        try:
            chunks = list(reader.read(Tidied(io.BytesIO(lines), self._dialect).readall()))
        except RowError as error:
            raise RecordingError("damaged", str(error), "repair the line") from None
        return [np.concatenate(parts) for parts in zip(*chunks)] if chunks else [np.empty(0) for _ in columns]

    @property
    def encoding(self) -> str:
        return self._dialect.encoding

    @property
    def offset(self) -> int:
        """Byte at which the rows of values begin."""
        return self._dialect.offset

    @property
    def _needs_tidying(self) -> bool:
        dialect = self._dialect
        return dialect.spaced or dialect.untidy or dialect.ragged or dialect.encoding.startswith("utf-16")

    @contextmanager
    def _opened(self) -> Iterator[Any]:
        """The file from its first row of numbers, tidied where that is needed."""
        with self.path.open("rb") as file:
            file.seek(self._dialect.offset)
            if self._needs_tidying:
                yield io.BufferedReader(Tidied(file, self._dialect), 1 << 20)
            else:
                yield file
