"""Beginning of a text table: its header, a row of units, the first row of values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

from livebode.core import read_unit
from livebode.sources.cells import EMPTY, CellKind, is_moment, is_number, is_value, is_word
from livebode.sources.units import SECONDS, split_unit, unbracketed

_UNITS = frozenset(
    (
        "v",
        "volt",
        "volts",
        "mv",
        "amp",
        "amps",
        "ampere",
        "ma",
        "w",
        "hz",
        "db",
        "%",
        "°c",
        "bar",
        "g",
        "value",
        "counts",
    )
)
"""Besides those of time and of the kinds of quantities; without capitals."""


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
    return bool(texts) and all(
        text in SECONDS or text in _UNITS or read_unit(unbracketed(cell)).kind != "other"
        for text, cell in zip(texts, filled)
    )


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
