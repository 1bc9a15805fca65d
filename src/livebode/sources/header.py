"""Beginning of a text table: its header, a row of units, the first row of values."""

from __future__ import annotations

from livebode.sources.cells import EMPTY, CellKind, is_moment, is_number, is_value
from livebode.sources.units import unbracketed


def find_header(
    table: list[list[str]], kinds: tuple[CellKind, ...], decimal: str, *, trailing: bool
) -> tuple[int, list[str], list[str]]:
    """Index of the first row of values, the header above it and the units between them (each empty without).

    `trailing` is true if each row ends with a delimiter; the header may lack it.

    The header is the first line of words that is as wide as the table and is followed by a row that fits the table.
    A line of preamble may be as wide, but the line after it does not fit.
    """
    width = len(kinds)
    lengths = (width, width - 1) if trailing and width > 1 else (width,)
    heads = [at for at, cells in enumerate(table[:-1]) if len(cells) in lengths and is_words(cells, decimal, trailing)]
    for at in heads:
        header, below = padded(table[at], width), table[at + 1]
        if fits(below, kinds, decimal):
            return at + 1, header, []
        if len(below) in lengths and no_values(below, decimal) and fits_at(table, at + 2, kinds, decimal):
            return at + 2, header, [unbracketed(unit) for unit in padded(below, width)]
    first = next(
        at for at, cells in enumerate(table) if len(cells) == width and any(is_value(cell, decimal) for cell in cells)
    )
    if heads and heads[0] < first:
        return heads[0] + 1, padded(table[heads[0]], width), []
    return first, [], []


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
