"""The header of a text table that has it in a comment: `#time,accel_x` or `# t n u v`."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from livebode.sources.units import BRACKETED

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
