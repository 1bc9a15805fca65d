"""The rows of properties of a TwinCAT export with blanks between the cells and, without quotes, within names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain

UNIT = re.compile(r"\S* ?\([^()]*\)")
"""A unit with its quantity: "mm (Length)", "(None)"."""
OTHER = " ScaleFactor", " Offset"
"""Endings of the properties whose own name has two words: Unit ScaleFactor, Unit Offset."""


def properties_of_words(lines: Sequence[str]) -> dict[str, list[str]]:
    """The cells of Name, SymbolName and Unit, each with the name of the property instead of a time column.

    Symbols have no blanks and thus show how many channels follow each time column. Where a group has more words than
    channels, its channels go by their symbols, with a number where several have one symbol.

    >>> properties = properties_of_words(["Name i Name my pos vel", "SymbolName A.i SymbolName A.p A.v"])
    >>> properties["Name"]
    ['Name', 'i', 'Name', 'A.p', 'A.v']
    """
    rows = {line.split(" ")[0]: line for line in lines if not any(f"Unit{ending}" in line for ending in OTHER)}
    symbols = list(groups(rows.get("SymbolName", "").split(), "SymbolName"))
    flat = iter(unique_names(list(chain(*symbols)), list(chain(*symbols))))
    unique = [[next(flat) for _ in group] for group in symbols]
    names = list(groups(rows.get("Name", "").split(), "Name"))
    if len(names) != len(symbols):
        return {}
    properties = {
        "SymbolName": joined("SymbolName", symbols),
        "Name": joined("Name", [named(words, own) for words, own in zip(names, unique, strict=True)]),
    }
    parts = re.split(r"(?:^| )Unit ", rows.get("Unit", ""))[1:]
    units = [[unit.strip() for unit in UNIT.findall(part)] for part in parts]
    if [len(group) for group in units] == [len(group) for group in symbols]:
        properties["Unit"] = joined("Unit", units)
    return properties


def groups(words: Sequence[str], key: str) -> Iterator[list[str]]:
    """The words behind each `key`."""
    places = [k for k, word in enumerate(words) if word == key]
    for first, last in zip(places, [*places[1:], len(words)], strict=True):
        yield list(words[first + 1 : last])


def named(words: list[str], symbols: list[str]) -> list[str]:
    if len(words) == len(symbols):
        return words
    return [" ".join(words)] if len(symbols) == 1 else symbols


def unique_names(names: Sequence[str], symbols: Sequence[str]) -> list[str]:
    """The names; where several are equal the symbols, and where these are, too, with a number from 2.

    >>> unique_names(["x", "x", "y", "y"], ["A.x", "B.x", "A.y", "A.y"])
    ['A.x', 'B.x', 'A.y', 'A.y (2)']
    """
    count = Counter(name for name in names if name)
    seen: Counter[str] = Counter()
    unique = []
    for name, symbol in zip(names, symbols, strict=True):
        own = symbol if count[name] > 1 and symbol else name
        seen[own] += 1
        unique.append(own if seen[own] == 1 or not own else f"{own} ({seen[own]})")
    return unique


def joined(key: str, cells: Sequence[Sequence[str]]) -> list[str]:
    return [cell for group in cells for cell in (key, *group)]
