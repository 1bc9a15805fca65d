"""Layout of a text table, detected from its first lines: encoding, delimiter, decimal mark, header, units, kinds."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from livebode.core import RecordingError
from livebode.dataclass import dataclass
from livebode.sources.cells import EMPTY, CellKind, is_comment, is_number, is_value, is_word, kind_of, zoned
from livebode.sources.header import find_comment_header, find_header, fits, keyed_header, no_values, stated_period_s
from livebode.sources.recording import COLUMNS_MAX, oversized

SAMPLE_BYTES = 1 << 18
SAMPLE_LINES = 400
DELIMITERS = "\t", ";", ",", "|", " ", ""
"""In order of preference at equal score; a blank means runs of blanks, the empty string a single column."""
SEPARATOR = re.compile(r"sep=.\s*$", re.IGNORECASE)
"""Line that Excel writes above a table; it is skipped, because the table itself is more reliable."""
COMMENT = re.compile(r"^[ \t]*[#%]", re.MULTILINE)
BLANK_CELL = re.compile(r"(\S+| )(?: |$)")
"""A cell of a ragged table in which a blank is the delimiter and also an empty cell, as TwinCAT Scope writes it."""
BLANK = " \t\r\n\v\f\x1a"
"""Characters of a line without content."""
END_BYTES = 64
UTF16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}


@dataclass(frozen=True)
class Dialect:
    """Layout of a table.

    Parameters
    ----------
    delimiter, spaced, decimal
        Separator of the cells (after tidying, a tab for runs of blanks), and the decimal mark.
    encoding, offset, first_line
        Encoding, and where the rows of values begin: byte of the file, and line from 1.
    headings, units, kinds
        One for each column: its name including the unit, the unit from a row of units, and the kind of its values.
    zone
        Time zone of dates that contain one.
    period_s
        Time from sample to sample, as the lines above the table say.
    untidy
        True if there are comments between the rows, or a blank or Ctrl-Z at the end.
    ragged
        True if a line may lack its last cells, and the last line may be EOF; between blanks, an empty cell is a blank.
    """

    delimiter: str
    spaced: bool
    decimal: str
    encoding: str = "utf-8"
    offset: int = 0
    first_line: int = 1
    headings: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    kinds: tuple[CellKind, ...] = ()
    zone: str | None = None
    period_s: float | None = None
    untidy: bool = False
    ragged: bool = False

    @property
    def width(self) -> int:
        return len(self.headings)

    def with_headings(self, headings: Sequence[str]) -> Dialect:
        """The dialect of a table of numbers with these headings."""
        width = len(headings)
        if width > COLUMNS_MAX:
            raise oversized(f"the table has {width} columns, more than {COLUMNS_MAX}", COLUMNS_MAX, columns=width)
        return replace(self, headings=tuple(headings), units=("",) * width, kinds=(CellKind.NUMBER,) * width)

    def split(self, line: str) -> list[str]:
        """Cells of a line."""
        if self.spaced:
            return BLANK_CELL.findall(line) if self.ragged else line.split()
        if not self.delimiter:
            return [line.strip().strip('"')]
        return [cell.strip() for cell in next(csv.reader([line], delimiter=self.delimiter), [])]


@dataclass(frozen=True)
class Line:
    """A line of the sample: its number from 1, where it begins in the sample's text, and its text."""

    number: int
    at: int
    text: str


@dataclass(frozen=True)
class Layout:
    """Result for one delimiter: its score (the second part: it has a header), the dialect, the first line of values."""

    score: tuple[float, bool, int]
    dialect: Dialect
    start: Line


@dataclass(frozen=True)
class Sample:
    """The first lines of a text file, and its last bytes."""

    path: Path
    text: str
    encoding: str
    mark: int
    lines: list[Line]
    end: bytes

    @classmethod
    def of(cls, path: Path) -> Sample:
        with path.open("rb") as file:
            sample = file.read(SAMPLE_BYTES)
            end = file.seek(max(0, path.stat().st_size - END_BYTES)) and file.read(END_BYTES)
        encoding, mark = find_encoding(sample)
        if not encoding.startswith("utf-16") and b"\0" in sample:
            raise RecordingError(
                "format-unknown", f"{path} contains binary data, not text", "check the name's ending", path=str(path)
            )
        text = sample[mark:].decode(encoding, "replace")
        lines = find_lines(path, text, whole=len(sample) < SAMPLE_BYTES)
        return cls(path, text, encoding, mark, lines, end or sample)

    def placed(self, dialect: Dialect, start: Line) -> Dialect:
        """The dialect with its encoding, and the place of its first row of values."""
        offset = self.mark + len(self.text[: start.at].encode(self.encoding, "replace"))
        untidy = COMMENT.search(self.text, start.at) is not None or ends_blank(self.end)
        return replace(dialect, encoding=self.encoding, offset=offset, first_line=start.number, untidy=untidy)

    def without_table(self) -> RecordingError:
        first = self.lines[0].text[:40] if self.lines else ""
        return RecordingError(
            "table-missing",
            f"{self.path} has no row of numbers in its first {SAMPLE_BYTES >> 10} KiB (it begins with {first!r})",
            "check that this is a recording",
            path=str(self.path),
            beginning=first,
        )


def find_dialect(path: Path) -> Dialect:
    """The dialect of the table in `path`.

    Raises
    ------
    RecordingError
        Where there is no table of numbers in the first 256 KiB.
    """
    sample = Sample.of(path)
    lines = sample.lines
    layouts = [layout for delimiter in DELIMITERS for decimal in ".," if (layout := lay_out(lines, delimiter, decimal))]
    if not layouts:
        raise sample.without_table()
    best = max(layouts, key=lambda layout: layout.score)
    if best.dialect.width > COLUMNS_MAX:
        width = best.dialect.width
        raise oversized(
            f"{path} has {width} columns, more than {COLUMNS_MAX}", COLUMNS_MAX, path=str(path), columns=width
        )
    above = sample.text[: best.start.at]
    dialect = best.dialect if best.score[1] else with_comment_header(best.dialect, above)
    ends_by_word = not dialect.spaced and sample.end.rstrip().endswith(b"\nEOF")
    period_s = dialect.period_s or stated_period_s(above)
    return sample.placed(replace(dialect, ragged=ends_by_word, period_s=period_s), best.start)


def ends_blank(end: bytes) -> bool:
    """True if the last line of a text, from its last bytes, has blanks only, or ends with Ctrl-Z."""
    last = end.rstrip(b"\r\n").rpartition(b"\n")[2]
    return not last.strip(BLANK.encode()) or last.endswith(b"\x1a")


def with_comment_header(dialect: Dialect, above: str) -> Dialect:
    """The dialect with the names and units that the comments above its first row contain."""
    comments = [line for line in above.splitlines() if is_comment(line)]
    delimiter = " " if dialect.spaced else dialect.delimiter
    header, units = find_comment_header(comments, dialect.width, delimiter)
    return replace(dialect, headings=tuple(header), units=tuple(units) or dialect.units) if header else dialect


def find_encoding(sample: bytes) -> tuple[str, int]:
    """Encoding, and length of the byte order mark: UTF-16 by its mark, else UTF-8 where it decodes.

    Else GB 18030, where all bytes of letters are in pairs as in Chinese (GB 2312); else Latin-1.

    >>> [find_encoding("转矩 [N m]".encode(of))[0] for of in ("utf-8", "gb18030")], find_encoding(b"Dr\\xfccke [\\xb0]")
    (['utf-8', 'gb18030'], ('latin-1', 0))
    """
    if sample[:2] in UTF16:
        return UTF16[sample[:2]], 2
    mark = 3 if sample.startswith(codecs.BOM_UTF8) else 0
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample[mark:])  # a character cut at the end is not an error
    except UnicodeDecodeError:
        return ("gb18030" if _in_chinese(sample) else "latin-1"), 0
    return "utf-8", mark


def _in_chinese(sample: bytes) -> bool:
    """Whether the bytes are a text in GB 2312, whose letters are pairs of bytes of which both have the highest bit."""
    try:
        codecs.getincrementaldecoder("gb2312")().decode(sample)
    except UnicodeDecodeError:
        return False
    return True


def find_lines(path: Path, text: str, *, whole: bool) -> list[Line]:
    """Lines of the sample that are neither blank nor comment; the last one only if the sample is the complete file."""
    lines, at = [], 0
    for number, line in enumerate(text.splitlines(keepends=True) if "\r" not in text else split_ends(text), start=1):
        complete = whole or line.endswith(("\n", "\r"))
        if complete and line.strip(BLANK) and not is_comment(line) and not (number == 1 and SEPARATOR.match(line)):
            lines.append(Line(number, at, line.rstrip("\r\n\x1a")))
        at += len(line)
        if len(lines) >= SAMPLE_LINES:
            break
    if not lines and not whole:
        raise RecordingError(
            "line-too-long",
            f"the first line of {path} is longer than {len(text)} characters",
            "check that this is a recording",
            path=str(path),
            line=1,
            limit_bytes=SAMPLE_BYTES,
        )
    return lines


def split_ends(text: str) -> list[str]:
    return re.findall(r"[^\r\n]*(?:\r\n|\n|\r)|[^\r\n]+$", text)


def lay_out(lines: list[Line], delimiter: str, decimal: str) -> Layout | None:
    """Result for `delimiter` and `decimal`; None if there is no row of numbers."""
    if delimiter == decimal:
        return None
    dialect = Dialect("\t" if delimiter == " " else delimiter, delimiter == " ", decimal)
    try:
        table = [(line, dialect.split(line.text)) for line in lines]
    except csv.Error:
        return None
    if delimiter == "\t" and (mixed := with_blank_rows(table, decimal)):
        dialect, table = replace(dialect, spaced=True), mixed
    numeric = [any(is_value(cell, decimal) for cell in cells) for _, cells in table]
    widths = Counter(len(cells) for (_, cells), any_ in zip(table, numeric) if any_)
    if not widths:
        return None
    width = max(widths, key=lambda count: (widths[count], count))
    if delimiter and width == 1:
        return None
    rows_like = [at for at, (_, cells) in enumerate(table) if len(cells) == width and numeric[at]]
    columns = [[table[at][1][column] for at in rows_like] for column in range(width)]
    kinds = tuple(kind_of(cells, decimal) for cells in columns)
    cells_of = [cells for _, cells in table]
    trailing = not any(columns[-1])
    start, header, units = find_header(cells_of, kinds, decimal, trailing=trailing, blank=without_values(columns))
    if (last := last_words(cells_of, width, start, decimal)) is not None:
        # A preamble as wide as the table: its cells do not show what the columns contain.
        columns = [[cells[at] for cells in cells_of[last + 1 :] if len(cells) == width] for at in range(width)]
        kinds = tuple(kind_of(cells, decimal) for cells in columns)
        trailing = not any(columns[-1])
        from_, blank = max(last - 1, 0), without_values(columns)
        start, header, units = find_header(cells_of[from_:], kinds, decimal, trailing=trailing, blank=blank)
        start += from_
    keyed, keyed_units = keyed_header(cells_of[:start], width) if not any(columns[0]) else ([], [])
    if keyed:
        header, units = keyed, keyed_units
    rows = table[start:]
    share = round(values_share(columns, decimal) * fitting_share([cells for _, cells in table], kinds, decimal), 2)
    headings = tuple(heading or f"c{at}" for at, heading in enumerate(header or [""] * width, start=1))
    zone = "UTC" if any(zoned(cell) for cells in columns for cell in cells) else None
    if len(kinds) > 1 and not any(columns[-1]) and not (header and header[-1]):  # each line ends with a delimiter
        kinds, headings = (*kinds[:-1], CellKind.TEXT), (*headings[:-1], "")
    dialect = replace(dialect, headings=headings, units=tuple(units or [""] * width), kinds=kinds, zone=zone)
    dialect = without_statements(dialect, without_values(columns)) if header else dialect
    return Layout((share, bool(header), width), dialect, rows[0][0]) if rows else None


def without_statements(dialect: Dialect, blank: list[int]) -> Dialect:
    """The dialect without those blank columns whose heading or unit is a statement, as Rigol's Increment or "tInc = 1".

    A column for the time is blank in such a table too.
    """
    kinds, headings, period_s = list(dialect.kinds), list(dialect.headings), dialect.period_s
    for at in blank:
        name, value = headings[at].casefold(), dialect.units[at]
        period_s = float(value) if name == "increment" and is_number(value) else period_s
        if is_number(value) or "=" in name or (name.startswith("time") and any("=" in one for one in dialect.headings)):
            kinds[at], headings[at] = CellKind.TEXT, ""
    return replace(dialect, kinds=tuple(kinds), headings=tuple(headings), period_s=period_s)


def without_values(columns: list[list[str]]) -> list[int]:
    """Columns without a value in the second half of the rows."""
    return [at for at, cells in enumerate(columns) if not any(cells[len(cells) // 2 :])]


def last_words(table: list[list[str]], width: int, start: int, decimal: str) -> int | None:
    """The last row of words, as wide as the table, behind its supposed start and before most of its rows; else None."""
    behind = range(start, len(table) - len(table) // 2)
    words = [
        at
        for at in behind
        if len(table[at]) == width and any(map(is_word, table[at])) and no_values(table[at], decimal)
    ]
    return words[-1] if words else None


def with_blank_rows(table: list[tuple[Line, list[str]]], decimal: str) -> list[tuple[Line, list[str]]]:
    """The table with those rows split where blanks, not tabs, separate numbers; empty if that gives no equal rows.

    LabVIEW programs write such a first row below their header, "0.0 0.0 0".
    """
    rows = [line.text.split() for line, _ in table]
    odd = [len(cells) == 1 < len(words) and is_row(words, decimal) for (_, cells), words in zip(table, rows)]
    if not any(odd):
        return []
    split = [(line, words if at_odd else cells) for (line, cells), words, at_odd in zip(table, rows, odd)]
    values = [len(words) for words in rows if is_row(words, decimal)]
    same = all(words == cells for (_, cells), words in zip(split, rows) if any(is_value(c, decimal) for c in cells))
    return split if same and len(set(values)) == 1 else []


def is_row(words: list[str], decimal: str) -> bool:
    return all(is_value(word, decimal) for word in words)


def values_share(columns: list[list[str]], decimal: str) -> float:
    """Share of cells that are values or empty; a wrong delimiter gives text cells."""
    cells = [cell for column in columns for cell in column]
    return sum(is_value(cell, decimal) or cell in EMPTY for cell in cells) / max(len(cells), 1)


def fitting_share(rows: list[list[str]], kinds: tuple[CellKind, ...], decimal: str) -> float:
    """Share of lines that fit the table; a wrong delimiter fits only some of them."""
    return sum(fits(cells, kinds, decimal) for cells in rows) / max(len(rows), 1)
