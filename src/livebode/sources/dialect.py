"""How a table in text is written, told by its first lines: encoding, delimiter, decimal mark, header, units, kinds."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from livebode.nouns import InputError
from livebode.sources.recording import COLUMNS_MAX

SAMPLE_BYTES = 1 << 18
SAMPLE_LINES = 400
DELIMITERS = "\t", ";", ",", "|", " ", ""
"""In the order that settles a tie; a blank stands for runs of blanks, the empty one for a single column."""
WORDS = "NA", "N/A", "#N/A", "NaN", "nan", "NAN", "-nan", "-NaN", "null", "NULL", "None", "1.#QNAN", "1.#IND", "-1.#IND"
EMPTY = frozenset([*(" " * count for count in range(33)), *WORDS, *(f'"{word}"' for word in ("", "NaN"))])
"""Cells that mean "no value"."""
NUMBER = re.compile(r"[+-]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|inf(?:inity)?|nan)", re.IGNORECASE)
MOMENT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d(?::?\d\d(?::?\d\d(?:\.\d{1,9})?)?)?(?P<zone>Z|[+-]\d\d:?\d\d)?")
SEPARATOR = re.compile(r"sep=.\s*$", re.IGNORECASE)
"""What Excel writes above a table; the table itself tells more surely."""
COMMENT = re.compile(r"^[ \t]*[#%]", re.MULTILINE)
UTF16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}


class Kind(Enum):
    """What a column holds."""

    NUMBER = "numbers"
    MOMENT = "moments"
    TEXT = "text"


@dataclass(frozen=True)
class Dialect:
    """How a table is written.

    Parameters
    ----------
    delimiter, spaced, decimal
        What parts the cells (a tab where runs of blanks do, once tidied), and the decimal mark.
    encoding, offset, first_line
        Encoding, and where the rows of values begin: byte of the file, and line from 1.
    headings, units, kinds
        One for each column: its name with the unit in it, the unit from a row of units, and what it holds.
    zone
        Time zone of moments that state one.
    commented
        True where comments stand between the rows.
    """

    delimiter: str
    spaced: bool
    decimal: str
    encoding: str = "utf-8"
    offset: int = 0
    first_line: int = 1
    headings: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    kinds: tuple[Kind, ...] = ()
    zone: str | None = None
    commented: bool = False

    @property
    def width(self) -> int:
        return len(self.headings)

    def split(self, line: str) -> list[str]:
        """Cells of a line."""
        if self.spaced:
            return line.split()
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
    """What one delimiter makes of the sample: the score to compare by, the dialect, and the first line of values."""

    score: tuple[float, bool, int]
    dialect: Dialect
    start: Line


def is_number(cell: str, decimal: str = ".") -> bool:
    """
    >>> is_number("-1.5e3"), is_number("1,5"), is_number("1,5", ","), is_number("abc")
    (True, False, True, False)
    """
    if decimal != ".":
        cell = cell.replace(".", "x").replace(decimal, ".")
    return NUMBER.fullmatch(cell) is not None


def is_moment(cell: str) -> bool:
    """
    >>> is_moment("2024-05-01 12:00:00.000250"), is_moment("12:00")
    (True, False)
    """
    return MOMENT.fullmatch(cell) is not None


def is_comment(line: str) -> bool:
    return line.lstrip().startswith(("#", "%"))


def find_dialect(path: Path) -> Dialect:
    """The dialect of the table in `path`.

    Raises
    ------
    InputError
        Where there is no table of numbers in the first 256 KiB.
    """
    with path.open("rb") as file:
        sample = file.read(SAMPLE_BYTES)
    encoding, mark = find_encoding(sample)
    if not encoding.startswith("utf-16") and b"\0" in sample:
        raise InputError(f"{path} holds binary data, not text; is its ending right?")
    text = sample[mark:].decode(encoding, "replace")
    lines = find_lines(path, text, whole=len(sample) < SAMPLE_BYTES)
    layouts = [layout for delimiter in DELIMITERS for decimal in ".," if (layout := lay_out(lines, delimiter, decimal))]
    if not layouts:
        first = lines[0].text[:40] if lines else ""
        raise InputError(f"{path} has no row of numbers in its first {len(sample)} bytes (it begins with {first!r})")
    best = max(layouts, key=lambda layout: layout.score)
    if best.dialect.width > COLUMNS_MAX:
        raise InputError(f"{path} has {best.dialect.width} columns, more than {COLUMNS_MAX}; is it a recording?")
    offset = mark + len(text[: best.start.at].encode(encoding, "replace"))
    commented = COMMENT.search(text, best.start.at) is not None
    return replace(best.dialect, encoding=encoding, offset=offset, first_line=best.start.number, commented=commented)


def find_encoding(sample: bytes) -> tuple[str, int]:
    """Encoding, and length of the byte order mark: UTF-16 by its mark, else UTF-8 where it decodes, else Latin-1."""
    if sample[:2] in UTF16:
        return UTF16[sample[:2]], 2
    mark = 3 if sample.startswith(codecs.BOM_UTF8) else 0
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample[mark:])  # a character cut at the end is no error
    except UnicodeDecodeError:
        return "latin-1", 0
    return "utf-8", mark


def find_lines(path: Path, text: str, *, whole: bool) -> list[Line]:
    """The lines of the sample that are neither blank nor comment; the last one only if the sample is the whole file."""
    lines, at = [], 0
    for number, line in enumerate(text.splitlines(keepends=True) if "\r" not in text else split_ends(text), start=1):
        complete = whole or line.endswith(("\n", "\r"))
        if complete and line.strip() and not is_comment(line) and not (number == 1 and SEPARATOR.match(line)):
            lines.append(Line(number, at, line.rstrip("\r\n")))
        at += len(line)
        if len(lines) >= SAMPLE_LINES:
            break
    if not lines and not whole:
        raise InputError(f"the first line of {path} is longer than {len(text)} characters; is it a recording?")
    return lines


def split_ends(text: str) -> list[str]:
    return re.findall(r"[^\r\n]*(?:\r\n|\n|\r)|[^\r\n]+$", text)


def lay_out(lines: list[Line], delimiter: str, decimal: str) -> Layout | None:
    """What `delimiter` and `decimal` make of the lines; None where they leave no row of numbers."""
    if delimiter == decimal:
        return None
    dialect = Dialect("\t" if delimiter == " " else delimiter, delimiter == " ", decimal)
    try:
        table = [(line, dialect.split(line.text)) for line in lines]
    except csv.Error:
        return None
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
    start, header, units = find_header([cells for _, cells in table], kinds, decimal, trailing=not any(columns[-1]))
    rows = table[start:]
    share = round(values_share(columns, decimal) * fitting_share([cells for _, cells in table], kinds, decimal), 2)
    headings = tuple(heading or f"c{at}" for at, heading in enumerate(header or [""] * width, start=1))
    zone = "UTC" if any(zoned(cell) for cells in columns for cell in cells) else None
    kinds = drop_trailing(kinds, header, columns)
    dialect = replace(dialect, headings=headings, units=tuple(units or [""] * width), kinds=kinds, zone=zone)
    return Layout((share, bool(header), width), dialect, rows[0][0]) if rows else None


def values_share(columns: list[list[str]], decimal: str) -> float:
    """How many of the cells are values or empty: the wrong delimiter leaves text."""
    cells = [cell for column in columns for cell in column]
    return sum(is_value(cell, decimal) or cell in EMPTY for cell in cells) / max(len(cells), 1)


def fitting_share(rows: list[list[str]], kinds: tuple[Kind, ...], decimal: str) -> float:
    """How many of the lines fit the table: the wrong delimiter suits only some."""
    return sum(fits(cells, kinds, decimal) for cells in rows) / max(len(rows), 1)


def is_value(cell: str, decimal: str) -> bool:
    return is_number(cell, decimal) or is_moment(cell)


def zoned(cell: str) -> bool:
    match = MOMENT.fullmatch(cell)
    return bool(match and match["zone"])


def kind_of(cells: list[str], decimal: str) -> Kind:
    """What a column holds: text only where no cell is a value, so that text among numbers is found as an error."""
    filled = [cell for cell in cells if cell not in EMPTY]
    if any(is_number(cell, decimal) for cell in filled) or not filled:
        return Kind.NUMBER
    return Kind.MOMENT if any(is_moment(cell) for cell in filled) else Kind.TEXT


def drop_trailing(kinds: tuple[Kind, ...], header: list[str], columns: list[list[str]]) -> tuple[Kind, ...]:
    """The kinds, with a last column that has neither heading nor values (a delimiter ends each line) as text."""
    if len(kinds) > 1 and not any(columns[-1]) and not (header and header[-1]):
        return (*kinds[:-1], Kind.TEXT)
    return kinds


def find_header(
    table: list[list[str]], kinds: tuple[Kind, ...], decimal: str, *, trailing: bool
) -> tuple[int, list[str], list[str]]:
    """Index of the first row of values, the header above it and the units between them (each empty without).

    `trailing` says that each row ends in a delimiter, which the header may lack.

    The header is the first line of words as wide as the table above a row that fits the table; a line of preamble may
    be as wide, but what follows it does not fit.
    """
    width = len(kinds)
    lengths = (width, width - 1) if trailing and width > 1 else (width,)
    heads = [at for at, cells in enumerate(table[:-1]) if len(cells) in lengths and is_words(cells, decimal, trailing)]
    for at in heads:
        header, below = padded(table[at], width), table[at + 1]
        if fits(below, kinds, decimal):
            return at + 1, header, []
        if len(below) in lengths and no_values(below, decimal) and fits_at(table, at + 2, kinds, decimal):
            return at + 2, header, [unit.strip("[]()-") for unit in padded(below, width)]
    first = next(
        at for at, cells in enumerate(table) if len(cells) == width and any(is_value(cell, decimal) for cell in cells)
    )
    if heads and heads[0] < first:
        return heads[0] + 1, padded(table[heads[0]], width), []
    return first, [], []


def is_words(cells: list[str], decimal: str, trailing: bool) -> bool:
    """True for a line that may be a header: no value and no gap in it, but for a delimiter at its end."""
    body = cells[:-1] if trailing and len(cells) > 1 and not cells[-1] else cells
    return all(body) and no_values(body, decimal)


def no_values(cells: list[str], decimal: str) -> bool:
    return any(cells) and not any(is_value(cell, decimal) for cell in cells)


def fits_at(table: list[list[str]], at: int, kinds: tuple[Kind, ...], decimal: str) -> bool:
    return at < len(table) and fits(table[at], kinds, decimal)


def fits(cells: list[str], kinds: tuple[Kind, ...], decimal: str) -> bool:
    if len(cells) != len(kinds):
        return False
    return all(cell in EMPTY or fits_kind(cell, kind, decimal) for cell, kind in zip(cells, kinds))


def fits_kind(cell: str, kind: Kind, decimal: str) -> bool:
    if kind is Kind.NUMBER:
        return is_number(cell, decimal)
    return kind is Kind.TEXT or is_moment(cell)


def padded(cells: list[str], width: int) -> list[str]:
    return [*cells, *[""] * (width - len(cells))]
