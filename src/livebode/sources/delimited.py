"""CSV, TSV and similar: detected by `dialect`, parsed as a stream by Arrow, errors located by `locate`."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
from pyarrow import csv

from livebode.core import RecordingError
from livebode.sources.cells import EMPTY, CellKind
from livebode.sources.columnar import to_numpy
from livebode.sources.dialect import Dialect, find_dialect
from livebode.sources.locate import locate
from livebode.sources.recording import Chunk, Column, Recording, Skipped
from livebode.sources.tidy import Tidied
from livebode.sources.units import split_units
from livebode.sources.whole_lines import whole_lines

ARROW_BLOCK_BYTES = 1 << 20
"""Arrow parses blocks of this size in parallel; no line can be longer."""
_PIECE_BYTES = 4 * ARROW_BLOCK_BYTES


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

    def find_dialect(self, path: Path) -> Dialect:
        """Layout of the table; a format that declares its own replaces this."""
        return find_dialect(path)

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        del rows
        required = list(dict.fromkeys(column.key for column in columns))
        try:
            with self._opened() as file:
                yield from self._parsed(file, columns)
        except pa.ArrowInvalid as error:
            raise locate(self.path, self._dialect, required, ARROW_BLOCK_BYTES) or RecordingError(
                "damaged", f"cannot read {self.path}: {first_line(error)}", "repair the file", path=str(self.path)
            ) from error

    def parsed(self, lines: bytes, columns: Sequence[Column]) -> Chunk:
        """The values of `columns` in whole lines of the table; RecordingError where one of them does not fit it."""
        dialect = self._dialect
        try:
            chunks = list(self._parsed(Tidied(io.BytesIO(lines), dialect), columns))
        except pa.ArrowInvalid as error:
            raise RecordingError("damaged", first_line(error), "repair the line") from None
        return [np.concatenate(parts) for parts in zip(*chunks)] if chunks else [np.empty(0) for _ in columns]

    @property
    def encoding(self) -> str:
        return self._dialect.encoding

    @property
    def offset(self) -> int:
        """Byte at which the rows of values begin."""
        return self._dialect.offset

    def _parsed(self, file: Any, columns: Sequence[Column]) -> Iterator[Chunk]:
        dialect = self._dialect
        required = list(dict.fromkeys(column.key for column in columns))
        names = [str(at) for at in range(dialect.width)]
        moment = pa.timestamp("ns", dialect.zone)
        types = {names[at]: moment if dialect.kinds[at] is CellKind.MOMENT else pa.float64() for at in required}
        options: Any = {
            "read_options": csv.ReadOptions(column_names=names, block_size=ARROW_BLOCK_BYTES),
            "parse_options": csv.ParseOptions(
                delimiter=dialect.delimiter or "\x1f",
                quote_char=False if dialect.spaced else '"',
            ),
            "convert_options": csv.ConvertOptions(
                column_types=types,
                include_columns=[names[at] for at in required],
                decimal_point=dialect.decimal,
                null_values=list(EMPTY),
                check_utf8=False,
            ),
        }
        # Arrow's own stream reads ahead in threads that outlive it: a program that ends meanwhile ends by a signal.
        for piece in whole_lines(file, _PIECE_BYTES):
            for batch in csv.read_csv(pa.BufferReader(piece), **options).to_batches():
                yield [to_numpy(batch.column(required.index(column.key))) for column in columns]

    @contextmanager
    def _opened(self) -> Iterator[Any]:
        """The file from its first row of numbers, as bytes that Arrow can parse."""
        dialect = self._dialect
        if dialect.spaced or dialect.untidy or dialect.ragged or dialect.encoding.startswith("utf-16"):
            with self.path.open("rb") as raw:
                raw.seek(dialect.offset)
                yield io.BufferedReader(Tidied(raw, dialect), 1 << 20)
        else:
            with self.path.open("rb") as file:
                file.seek(dialect.offset)
                yield file


def first_line(error: pa.ArrowInvalid) -> str:
    return str(error).splitlines()[0][:200]


READER = DelimitedRecording
