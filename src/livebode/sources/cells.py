"""What a cell of a text table may contain: a number, a date and time, nothing, or text."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from enum import Enum

WORDS = "NA", "N/A", "#N/A", "NaN", "nan", "NAN", "-nan", "-NaN", "null", "NULL", "None", "1.#QNAN", "1.#IND", "-1.#IND"
EMPTY = frozenset([*(" " * count for count in range(33)), *WORDS, *(f'"{word}"' for word in ("", "NaN"))])
"""Cells that mean "no value"."""
NUMBER = re.compile(r"[+-]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|inf(?:inity)?|nan)", re.IGNORECASE)
MOMENT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d(?::?\d\d(?::?\d\d(?:\.\d{1,9})?)?)?(?P<zone>Z|[+-]\d\d:?\d\d)?")


EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
YEARS = range(1678, 2262)
"""Whose nanoseconds fit in 64 bits."""


class CellKind(Enum):
    """Content of a column."""

    NUMBER = "numbers"
    MOMENT = "moments"
    TEXT = "text"


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


def moment_ns(cell: str, *, has_zone: bool) -> int | None:
    """Nanoseconds since 1970 of a date and time; None if it is not one, or has a zone where the others have none.

    >>> moment_ns("1970-01-01T00:01", has_zone=False), moment_ns("1970-01-01 01:00:00.000250+01:00", has_zone=True)
    (60000000000, 250000)
    """
    match = MOMENT.fullmatch(cell)
    if match is None or bool(match["zone"]) != has_zone or int(cell[:4]) not in YEARS:
        return None
    zone = match["zone"] or ""
    clock, _, fraction = cell[11 : len(cell) - len(zone)].replace(":", "").partition(".")
    try:
        moment = datetime.fromisoformat(f"{cell[:10]}T{clock:0<6}{zone or 'Z'}")
    except ValueError:
        return None
    return (moment - EPOCH) // timedelta(seconds=1) * 1_000_000_000 + int(f"{fraction:0<9}")


def is_comment(line: str) -> bool:
    return line.lstrip().startswith(("#", "%"))


def is_value(cell: str, decimal: str) -> bool:
    return is_number(cell, decimal) or is_moment(cell)


def zoned(cell: str) -> bool:
    match = MOMENT.fullmatch(cell)
    return bool(match and match["zone"])


def is_word(cell: str) -> bool:
    """True for text that is not a damaged number.

    >>> is_word("ANGLE_MODE|HORIZON"), is_word("1.2.3"), is_word("-")
    (True, False, False)
    """
    return cell[:1].isalpha() and cell not in EMPTY and not is_number(cell)


def kind_of(cells: list[str], decimal: str) -> CellKind:
    """Content of a column: text if no cell is a value, or if several are words (flags, some of them 0).

    One word, or damaged numbers, among numbers are not a column of text but an error in one line.
    """
    filled = [cell for cell in cells if cell not in EMPTY]
    if sum(map(is_word, filled)) > 1:
        return CellKind.TEXT
    if any(is_number(cell, decimal) for cell in filled) or not filled:
        return CellKind.NUMBER
    return CellKind.MOMENT if any(is_moment(cell) for cell in filled) else CellKind.TEXT
