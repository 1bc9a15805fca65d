"""Header of a text table: names and units in its first rows, and in statements and comments above them."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Sequence

from livebode.sources.cells import EMPTY, CellKind, is_moment, is_number, is_value, is_word
from livebode.sources.units import BRACKETED, SECONDS, is_unit, split_unit, unbracketed

_UNITS = frozenset(("volt", "volts", "amp", "amps", "ampere", "w", "hz", "db", "°c", "bar", "value"))
"""In addition to those of `is_unit`; without capitals."""


def find_header(
    table: list[list[str]],
    kinds: tuple[CellKind, ...],
    decimal: str,
    *,
    trailing: bool,
    blank: Collection[int] = (),
) -> tuple[int, list[str], list[str]]:
    """Index of the first row of values, the header above it and the units between them (each empty without).

    `trailing` is true if each row ends with a delimiter; the header may lack it. The columns `blank` have no values.

    The header is the first line of words that is as wide as the table and is followed by a row that fits the table.
    A line of preamble may be as wide, but the line after it does not fit. Units may be between them, and a row of
    numbers between blanks below the units. Cells that repeat, or are all units, are units: the names are above them.
    """
    width = len(kinds)
    table = [cells[:-1] if len(cells) == width + 1 and not cells[-1] else cells for cells in table]
    lengths = (width, width - 1) if trailing and width > 1 else (width,)
    heads = [at for at, cells in enumerate(table[:-1]) if len(cells) in lengths and is_words(cells, decimal, trailing)]
    for at in heads:
        header, below = padded(table[at], width), table[at + 1]
        if fits(below, kinds, decimal):
            above = padded(table[at - 1], width) if at and len(table[at - 1]) in lengths else []
            if are_units(header) and are_names(above):
                return at + 1, above, [unbracketed(unit) for unit in header]
            return at + 1, header, []
        words = [cell for column, cell in enumerate(below) if column not in blank]
        if len(below) in lengths and no_values(words, decimal):
            first = at + 3 if at + 2 < len(table) and are_numbers(table[at + 2], decimal) else at + 2
            if fits_at(table, first, kinds, decimal):
                return first, header, [unbracketed(unit) for unit in padded(below, width)]
    first = next(
        at for at, cells in enumerate(table) if len(cells) == width and any(is_value(cell, decimal) for cell in cells)
    )
    if heads and heads[0] < first:
        return heads[0] + 1, padded(table[heads[0]], width), []
    return first, [], []


def are_units(cells: list[str]) -> bool:
    """Whether cells repeat, or each of them is a unit."""
    filled = [cell for cell in cells if cell]
    if max(Counter(filled).values(), default=0) > 1:
        return True
    texts = [unbracketed(cell).casefold() for cell in filled]
    return bool(texts) and all(text in _UNITS or is_unit(unbracketed(cell)) for text, cell in zip(texts, filled))


def are_names(cells: list[str]) -> bool:
    """Whether cells differ and the first is a word: the others may be the numbers of channels."""
    filled = [split_unit(cell)[0] for cell in cells if cell]
    return bool(filled) and is_word(filled[0]) and len(set(filled)) == len(filled)


def are_numbers(cells: list[str], decimal: str) -> bool:
    """Whether each cell has several numbers between blanks, as a row of offsets."""
    words = [cell.split() for cell in cells if cell]
    return any(len(each) > 1 for each in words) and all(is_value(word, decimal) for each in words for word in each)


def is_words(cells: list[str], decimal: str, trailing: bool) -> bool:
    """True for a line that may be a header: no value and no empty cell, except after a delimiter at its end."""
    body = cells[:-1] if trailing and len(cells) > 1 and not cells[-1] else cells
    return all(body) and no_values(body, decimal)


def no_values(cells: list[str], decimal: str) -> bool:
    return any(cells) and not any(is_value(cell, decimal) for cell in cells)


def fits_at(table: list[list[str]], at: int, kinds: tuple[CellKind, ...], decimal: str) -> bool:
    return at < len(table) and fits(table[at], kinds, decimal)


def fits(cells: list[str], kinds: tuple[CellKind, ...], decimal: str) -> bool:
    if len(cells) != len(kinds):
        return False
    return all(cell in EMPTY or fits_kind(cell, kind, decimal) for cell, kind in zip(cells, kinds))


def fits_kind(cell: str, kind: CellKind, decimal: str) -> bool:
    if kind is CellKind.NUMBER:
        return is_number(cell, decimal)
    return kind is CellKind.TEXT or is_moment(cell)


def padded(cells: list[str], width: int) -> list[str]:
    return [*cells, *[""] * (width - len(cells))]


_NUMBER = r"(?P<value>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
_INTERVAL = re.compile(
    rf"\b(?:sampl\w*[ _](?:interval|period)|tinc|hresolution|delta[ _]?t)\b[^\w\n+.-]*(?:\w+:)?[^\w\n+.-]*{_NUMBER}"
    r"[^\w\n]{0,3}(?P<unit>[mµun]?s(?:ec)?\b)?",
    re.IGNORECASE,
)
_RATE = re.compile(
    rf"\bsampl\w*[ _]?(?:rate|frequency|freq)\b[^\w\n+.-]*-? ?(?:\w+:)?{_NUMBER}[^\w\n]{{0,2}}(?P<unit>[kMG]?)",
    re.IGNORECASE,
)
_PREFIX = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
_NAMES = re.compile(r"(?:trace|channel|signal)[ _]?names?|names?|labels?", re.IGNORECASE)
_UNITS_OF = re.compile(r"(?:v|y|vertical[ _]?)?units?", re.IGNORECASE)


def stated_period_s(above: str) -> float | None:
    """Seconds from sample to sample, as the lines above a table say.

    >>> stated_period_s("Sample Interval,CH1:2.0E-03"), stated_period_s("Sampling Frequency - 1000")
    (0.002, 0.001)
    >>> stated_period_s("CH1(V),t0 = -5e-01, tInc = 1.0e-03,"), stated_period_s("Sample,of,nothing")
    (0.001, None)
    """
    if found := _INTERVAL.search(above):
        period_s = float(found["value"]) * SECONDS.get((found["unit"] or "s").casefold(), 1.0)
        return period_s if period_s > 0 else None
    if found := _RATE.search(above):
        rate_hz = float(found["value"]) * _PREFIX.get(found["unit"], 1.0)
        return 1 / rate_hz if rate_hz > 0 else None
    return None


def keyed_header(above: Sequence[list[str]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of a table whose first column has only the keys of the lines above it; empty without names.

    >>> keyed_header([["TraceName", "Force", "Accel"], ["VUnit", "N", "g"]], 3)
    (['', 'Force', 'Accel'], ['', 'N', 'g'])
    """
    rows = [cells for cells in above if len(cells) == width]
    found = [next((["", *cells[1:]] for cells in rows if key.fullmatch(cells[0])), []) for key in (_NAMES, _UNITS_OF)]
    return (found[0], found[1]) if found[0] else ([], [])


MARKS = " \t#%"
DELIMITERS = ",", ";", "\t", "|"


def find_comment_header(comments: Sequence[str], width: int, delimiter: str) -> tuple[list[str], list[str]]:
    """Names and units in the comments above a table of `width` columns; both empty if there are none.

    The comment next to the table is tried first, and only there may blanks separate the names, because prose has
    blanks too. A last comment of units in brackets belongs to the names above it.

    >>> find_comment_header(["# taken by hand", "#time,accel_x"], 2, ",")
    (['time', 'accel_x'], [])
    >>> find_comment_header(["# t u", "# [s] [V]"], 2, " ")
    (['t', 'u'], ['s', 'V'])
    """
    units: list[str] = []
    blanks = True
    for comment in reversed(comments):
        for cells in splits(comment, delimiter, blanks=blanks):
            if not units and all(map(BRACKETED.fullmatch, cells)) and len(cells) == width:
                units = [cell[1:-1].strip() for cell in cells]
                break
            if len(set(cells)) == len(cells) == width and all(map(is_name, cells)):
                return cells, units
        else:
            blanks = False
    return [], []


def splits(comment: str, delimiter: str, *, blanks: bool) -> list[list[str]]:
    """The cells of a comment under the table's own delimiter, then under the others."""
    body = comment.strip().lstrip(MARKS)
    own = [delimiter] if delimiter in DELIMITERS else []
    cells = [next(csv.reader([body], delimiter=mark), []) for mark in dict.fromkeys([*own, *DELIMITERS])]
    return [[cell.strip() for cell in found] for found in cells] + ([with_units(body.split())] if blanks else [])


def with_units(words: list[str]) -> list[str]:
    """Words with the unit in brackets that follows a name as part of it.

    >>> with_units(["t", "[s]", "n", "u", "(V)"])
    ['t [s]', 'n', 'u (V)']
    """
    cells: list[str] = []
    for word in words:
        if cells and BRACKETED.fullmatch(word) and not BRACKETED.fullmatch(cells[-1].split()[-1]):
            cells[-1] = f"{cells[-1]} {word}"
        else:
            cells.append(word)
    return cells


def is_name(cell: str) -> bool:
    return re.search(r"[^\W\d]", cell) is not None and not cell.endswith(":")
