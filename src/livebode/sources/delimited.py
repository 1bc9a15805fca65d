"""Text tables: whole lines of any stream, tidied, read by rows and columns; and the line that a reader rejects."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, BinaryIO, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import RecordingError
from livebode.sources.cells import EMPTY, CellKind, is_comment, is_moment, is_number, moment_ns
from livebode.sources.dialect import BLANK, Dialect, find_dialect
from livebode.sources.recording import Chunk, Column, Recording, Skipped
from livebode.sources.timing import time_rank
from livebode.sources.units import SECONDS, split_units
from livebode.tables import MOMENT, NO_MOMENT, NUMBER, SKIPPED, TableLayout, read_rows

ROW_BYTES_MAX = 1 << 20
_ROWS = 65528  # columns of so many doubles do not begin at the same place of a cache
_LINE_END = re.compile(rb"[\r\n]|$")


class RowError(ValueError):
    """A row that does not fit its table."""


class RowReader:
    r"""Reads the columns `keys` of rows that a dialect describes, after `Tidied` if it was needed.

    >>> dialect = Dialect(";", False, ",").with_headings(["t", "u"])
    >>> [[column.tolist() for column in chunk] for chunk in RowReader(dialect, [1, 0], "utf-8").read(b"0;1,5\n1;NaN")]
    [[[1.5, nan], [0.0, 1.0]]]
    """

    def __init__(self, dialect: Dialect, keys: Sequence[int], encoding: str) -> None:
        self._dialect, self._encoding = dialect, encoding
        self._columns = sorted(set(keys))
        self._order = [self._columns.index(key) for key in keys]
        self._moments = [dialect.kinds[at] is CellKind.MOMENT for at in self._columns]
        kinds = bytearray([SKIPPED] * dialect.width)
        for at, moment in zip(self._columns, self._moments):
            kinds[at] = MOMENT if moment else NUMBER
        self._layout = TableLayout(
            bytes(kinds),
            b"".join(word.encode() + b"\0" for word in sorted(EMPTY) if word.strip()),
            ROW_BYTES_MAX,
            ord("\t" if dialect.spaced else dialect.delimiter or "\x1f"),
            ord(dialect.decimal),
            0 if dialect.spaced else ord('"'),
            dialect.zone is not None,
        )

    def read(self, text: bytes) -> Iterator[Chunk]:
        """The values in whole lines.

        Raises
        ------
        RowError
            At a row that does not fit the table.
        """
        begin = 0
        while begin < len(text):
            rows = min(_ROWS, (len(text) - begin) // max(self._dialect.width, 2) + 1)
            out = np.empty((len(self._columns), rows))
            filled, begin = read_rows(self._layout, text, begin, out, 0)
            while begin < len(text) and filled < rows:
                end = _end_of_line(text, begin)
                if (row := self.row(text[begin:end])) is not None:
                    out[:, filled] = row
                    filled += 1
                filled, begin = read_rows(self._layout, text, end, out, filled)
            if filled:
                values = [_with_moments(c[:filled]) if is_m else c[:filled] for c, is_m in zip(out, self._moments)]
                yield [values[at] for at in self._order]

    def row(self, raw: bytes) -> NDArray[np.float64] | None:
        """The values of a line, by the definition; None if it is blank."""
        if len(raw) > ROW_BYTES_MAX:
            raise RowError(f"a line is longer than {ROW_BYTES_MAX} bytes")
        line = raw.decode(self._encoding, "replace")
        try:
            cells = line.split("\t") if self._dialect.spaced else self._dialect.split(line)
        except csv.Error as error:
            raise RowError(f"{line[:40]!r} is not a row: {error}") from None
        if len(cells) != self._dialect.width:
            if not line.strip(BLANK):
                return None
            raise RowError(f"{line[:40]!r} has {len(cells)} cells in place of {self._dialect.width}")
        row = np.empty(len(self._columns))
        for at, (column, moment) in enumerate(zip(self._columns, self._moments)):
            value = self._value(cells[column], moment)
            row[at] = np.int64(value).view(np.float64) if moment else value
        return row

    def _value(self, cell: str, is_moment: bool) -> float:
        stripped = cell.strip()
        if cell in EMPTY or stripped in EMPTY:
            return NO_MOMENT if is_moment else np.nan
        if not is_moment and is_number(stripped, self._dialect.decimal):
            return float(stripped.replace(self._dialect.decimal, "."))
        ns = moment_ns(stripped, has_zone=self._dialect.zone is not None) if is_moment else None
        if ns is None:
            raise RowError(f"{cell[:40]!r} is not a {'date and time' if is_moment else 'number'}")
        return ns


def _end_of_line(text: bytes, begin: int) -> int:
    found = _LINE_END.search(text, begin)
    return found.start() if found else len(text)


def _with_moments(column: NDArray[np.float64]) -> NDArray[np.int64] | NDArray[np.float64]:
    ns = column.view(np.int64)
    missing = ns == NO_MOMENT
    return np.where(missing, np.nan, ns) if missing.any() else ns


def whole_lines(file: IO[bytes], piece_bytes: int) -> Iterator[bytes]:
    r"""About `piece_bytes` at a time, as they are read; a line that is longer, or that has no end, may end anywhere.

    Lines end with ``\n``, ``\r\n`` or ``\r``. A piece may begin with the ``\n`` of the line before it.

    >>> import io
    >>> list(whole_lines(io.BytesIO(b"1\n22\n333\n4"), 4))
    [b'1\n', b'22\n', b'333\n', b'4']
    """
    rest = b""
    while piece := file.read(piece_bytes):
        end = max(piece.rfind(b"\n"), piece.rfind(b"\r")) + 1
        if end or len(rest) >= piece_bytes:
            yield rest + piece[:end]
            rest = piece[end:]
        else:
            rest += piece
    if rest:
        yield rest


PIECE = 1 << 20
COMMENT = re.compile(r"(?m)^[ \t]*[#%].*\n?")
BLANK_LINE = re.compile(r"(?m)^[ \x1a]+\r?(?:\n|\Z)")
END_MARK = "\x1a"
"""Ctrl-Z, which DOS programs and LabVIEW write at the end of a text."""
MARGINS = re.compile(r"(?m)^[ \t]+|[ \t]+(?=\r?$)")
BLANKS = re.compile(r"[ \t]+")


class Tidied(io.RawIOBase):
    r"""The text of `raw` from its current position, simplified line by line as its dialect needs it.

    >>> blanks = Dialect("\t", True, ".")
    >>> io.BufferedReader(Tidied(io.BytesIO(b"  1   2 \n# note\n 3 4"), blanks)).read()
    b'1\t2\n3\t4'
    """

    def __init__(self, raw: BinaryIO, dialect: Dialect) -> None:
        self._raw, self._dialect = raw, dialect
        # A ragged table grows by its width with each short line: its pieces are as much smaller.
        self._piece = max(1 << 12, PIECE // max(dialect.width, 1)) if dialect.ragged else PIECE
        self._decoder = codecs.getincrementaldecoder(dialect.encoding)("replace")
        self._kept = ""
        self._ready = b""
        self._done = False

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        while not self._ready and not self._done:
            self._fill()
        count = min(len(buffer), len(self._ready))
        buffer[:count] = self._ready[:count]
        self._ready = self._ready[count:]
        return count

    def _fill(self) -> None:
        raw = self._raw.read(self._piece)
        self._done = not raw
        text = self._kept + self._decoder.decode(raw, final=self._done)
        end = len(text) if self._done else text.rfind("\n") + 1
        if end == 0 and len(text) > 4 * PIECE:  # no valid line is this long; the reader of rows reports it
            end = len(text)
        text, self._kept = text[:end], text[end:]
        text = BLANK_LINE.sub("", COMMENT.sub("", text))
        if self._done:
            text = text.rstrip(END_MARK)
        if self._dialect.ragged:
            lines = (line.rstrip("\r") for line in text.split("\n"))
            text = "".join(self._filled(line) for line in lines if line.strip() not in ("", "EOF"))
        elif self._dialect.spaced:
            text = BLANKS.sub("\t", MARGINS.sub("", text))
        self._ready = text.encode("utf-8")

    def _filled(self, line: str) -> str:
        if self._dialect.spaced:
            line = "\t".join(self._dialect.split(line))
        missing = self._dialect.width - 1 - line.count(self._dialect.delimiter)
        return f"{line}{self._dialect.delimiter * missing}\n"


def locate(path: Path, dialect: Dialect, columns: Sequence[int], line_bytes_max: int) -> RecordingError | None:
    """The error in the first line that is too long, has a wrong number of cells, or text in `columns`; else None.

    Lines count from 1 as in an editor.
    """
    number = 0
    with path.open("r", encoding=dialect.encoding, errors="replace", newline=None) as file:
        while line := file.readline(line_bytes_max + 1):
            number += 1
            if number < dialect.first_line or not line.strip(BLANK) or (dialect.untidy and is_comment(line)):
                continue
            if len(line) > line_bytes_max:
                return RecordingError(
                    "line-too-long",
                    f"line {number} of {path} is longer than {line_bytes_max} bytes",
                    "check that this is a recording",
                    path=str(path),
                    line=number,
                    limit_bytes=line_bytes_max,
                )
            if error := check_line(path, dialect, columns, number, line.rstrip("\n")):
                return error
    return None


def check_line(path: Path, dialect: Dialect, columns: Sequence[int], number: int, line: str) -> RecordingError | None:
    cells = dialect.split(line)
    if dialect.ragged:
        if cells == ["EOF"]:
            return None
        cells += [""] * (dialect.width - len(cells))
    if len(cells) != dialect.width:
        return RecordingError(
            "line-ragged",
            f"line {number} of {path} has {len(cells)} cells, the others {dialect.width}",
            f"repair this line, or {_of_a_mark(dialect)}",
            path=str(path),
            line=number,
            cells=len(cells),
            columns=dialect.width,
        )
    for at in columns:
        cell = cells[at].strip()
        fits = is_moment(cell) if dialect.kinds[at] is CellKind.MOMENT else is_number(cell, dialect.decimal)
        if cell not in EMPTY and not fits:
            name = dialect.headings[at]
            return RecordingError(
                "cell-not-a-number",
                f"line {number} of {path}, column {name!r}: {cell[:40]!r} is not a number",
                "correct it, or leave it empty if this is not the time"
                if any(is_number(other, dialect.decimal) or is_moment(other) for other in cells)
                else _of_a_mark(dialect),
                path=str(path),
                line=number,
                channel=name,
                value=cell[:40],
            )
    return None


def _of_a_mark(dialect: Dialect) -> str:
    """Remedy for a line that a logger writes where samples are missing: without a time, it alone shows the gap."""
    row = (" " if dialect.spaced else dialect.delimiter).join(["nan"] * dialect.width)
    return (
        f"delete this line if the time continues to rise behind it, replace it by {row!r} if there is no column of "
        "time, or else split the file there"
    )


_PIECE_BYTES = 4 << 20


class DelimitedRecording(Recording):
    """A table in a text file. Its length is known only after reading."""

    format: ClassVar[str] = "csv"
    named_by_file: ClassVar[bool] = True

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
