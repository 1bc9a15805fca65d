"""Exports of TwinCAT Scope as text: rows of properties above the table, and a time column for each channel or group."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from livebode.sources import Chunk, Column, DelimitedRecording, Dialect, Sample, is_number
from livebode_drives.recordings.timed_columns import TimedColumns, as_columns, merged, trimmed
from livebode_drives.recordings.twincatwords import properties_of_words, unique_names

ROW = re.compile(r'[\s"]*[-+.\d]')
"""A row of values; each row above the table begins with the name of a property."""
QUANTITY = re.compile(r"\s*\([^()]*\)$")
TIME = "t"


class TwinCatRecording(DelimitedRecording):
    """A table whose rows of properties (Name, Unit, SymbolName …) also show which columns are times in ms."""

    format: ClassVar[str] = "twincat"
    named_by_file: ClassVar[bool] = False

    def __init__(self, path: Path) -> None:
        self._properties: dict[str, list[str]] = {}
        super().__init__(path)
        groups = timed_columns(self._properties)
        times = super().chunks([group.time for group in groups], 1 << 16)
        self.columns, self.skipped = tuple(as_columns(merged(groups, times))), ()

    def find_dialect(self, path: Path) -> Dialect:
        """The dialect as the export defines it: the delimiter behind "Name", one column for each cell of that row."""
        sample = Sample.of(path)
        start = next((index for index, line in enumerate(sample.lines) if ROW.match(line.text)), None)
        mark = sample.text[4]
        plain = Dialect("\t" if mark == " " else mark, mark == " ", ".", ragged=True)
        above = [line.text for line in sample.lines[:start]]
        self._properties = properties_of_words(above) if plain.spaced else properties_of_cells(above, plain)
        names = self._properties.get("Name", [])
        if start is None or len(names) < 2:
            raise sample.without_table()
        cells = [cell for line in sample.lines[start:] for cell in plain.split(line.text)]
        comma = mark != "," and any(is_number(cell, ",") and not is_number(cell) for cell in cells)
        dialect = replace(plain, decimal="," if comma else ".").with_headings(names)
        return sample.placed(dialect, sample.lines[start])

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        return trimmed(super().chunks(columns, rows), columns[0].samples)


def timed_columns(properties: dict[str, list[str]]) -> list[TimedColumns]:
    """The time columns and their channels, from the rows of properties by their first cell.

    A time column has the name of the property instead of a value.

    >>> group, = timed_columns({"Name": ["Name", "pos", "vel"], "Unit": ["Unit", "mm (Length)", "(None)"]})
    >>> group.time.name, [(column.name, column.unit) for column in group.channels]
    ('t', [('pos', 'mm'), ('vel', '')])
    """
    names = properties["Name"]
    symbols, units = (padded(properties.get(name, []), len(names)) for name in ("SymbolName", "Unit"))
    own = [index > 0 and name != "Name" for index, name in enumerate(names)]
    unique = unique_names([name if is_own else "" for name, is_own in zip(names, own)], symbols)
    groups: list[TimedColumns] = []
    for index, is_channel in enumerate(own):
        if not is_channel:
            groups.append(TimedColumns(Column(TIME, "ms", key=index), ()))
            continue
        symbol, unit = symbols[index], QUANTITY.sub("", units[index])
        if name := unique[index]:  # older exports end each row with a delimiter
            column = Column(name, unit, aliases=(symbol,) if symbol not in ("", name) else (), key=index)
            groups[-1] = TimedColumns(groups[-1].time, (*groups[-1].channels, column))
    return [group for group in groups if group.channels]


def properties_of_cells(lines: list[str], dialect: Dialect) -> dict[str, list[str]]:
    """The cells of each property by its name, which is also the first cell."""
    rows = [dialect.split(line) for line in lines]
    return {cells[0]: cells for cells in rows if cells and cells[0]}


def padded(cells: list[str], width: int) -> list[str]:
    return [*cells[:width], *[""] * (width - len(cells))]
