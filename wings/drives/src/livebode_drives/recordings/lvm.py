"""LabVIEW measurement files (.lvm): text with tags above the table; the time is a column or only its increment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from livebode.sources import Chunk, Column, DelimitedRecording, Dialect, Sample, exact_rate_hz, is_number
from livebode_drives.recordings.timed_columns import TimedColumns, as_columns, merged, trimmed

TIME = "X_Value"
COMMENT = "Comment"


class LvmRecording(DelimitedRecording):
    """The first segment of the file; a second one ends in a line that is not a row of numbers."""

    format: ClassVar[str] = "lvm"
    named_by_file: ClassVar[bool] = False

    def __init__(self, path: Path) -> None:
        self._tags: dict[str, list[str]] = {}
        super().__init__(path)
        columns = self._named()
        if self._tag("X_Columns", "One").casefold() == "no":
            self.columns, self.skipped = tuple(column for column in columns if column.name != TIME), ()
            self._read_increment()
            return
        groups: list[TimedColumns] = []
        for column in columns:
            if column.name == TIME:
                groups.append(TimedColumns(column, ()))
            elif groups:
                groups[-1] = replace(groups[-1], channels=(*groups[-1].channels, column))
        groups = [group for group in groups if group.channels]
        times = super().chunks([group.time for group in groups], 1 << 16)
        self.columns, self.skipped = tuple(as_columns(merged(groups, times))), ()

    def find_dialect(self, path: Path) -> Dialect:
        """The dialect as the tags of the file define it."""
        sample = Sample.of(path)
        start = next(
            (index for index, line in enumerate(sample.lines) if line.text.startswith(TIME)), len(sample.lines)
        )
        if start + 1 >= len(sample.lines):
            raise sample.without_table()
        separator = "," if any(line.text.startswith("Separator,") for line in sample.lines[:start]) else "\t"
        plain = Dialect(separator, False, ".", ragged=True)
        rows = [plain.split(line.text) for line in sample.lines[:start]]
        self._tags = {cells[0]: cells for cells in rows if cells}
        if separator != "," and self._tag("Decimal_Separator", ".") == ",":
            plain = replace(plain, decimal=",")
        return sample.placed(plain.with_headings(plain.split(sample.lines[start].text)), sample.lines[start + 1])

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        # The first cell of each line is read too: the tags of a second segment are text there.
        chunks = super().chunks([*columns, Column(TIME, key=0)], rows)
        return trimmed((chunk[:-1] for chunk in chunks), columns[0].samples)

    def _named(self) -> list[Column]:
        units = self._tags.get("Y_Unit_Label", [])
        horizontal = {"time": "s"}.get(self._tag("X_Dimension", "Time").casefold(), "")
        return [
            Column(name, horizontal if name == TIME else units[index] if index < len(units) else "", key=index)
            for index, name in enumerate(self._dialect.headings)
            if name not in ("", COMMENT)
        ]

    def _read_increment(self) -> None:
        increment = self._tag("Delta_X", "").replace(",", ".")
        if is_number(increment) and 0 < float(increment) < float("inf"):
            self.rate_hz = exact_rate_hz(float(increment), 0.0)

    def _tag(self, name: str, default: str) -> str:
        """The first value of a tag that is not empty."""
        return next((cell for cell in self._tags.get(name, [])[1:] if cell), default)
