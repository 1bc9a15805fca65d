"""Rows of a text table as columns: plain ones in C, the others cell by cell."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.sources.cells import EMPTY, CellKind, is_number, moment_ns
from livebode.sources.dialect import BLANK, Dialect
from livebode.sources.recording import Chunk
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
        for at, is_moment in zip(self._columns, self._moments):
            kinds[at] = MOMENT if is_moment else NUMBER
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
        for at, (column, is_moment) in enumerate(zip(self._columns, self._moments)):
            value = self._value(cells[column], is_moment)
            row[at] = np.int64(value).view(np.float64) if is_moment else value
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
