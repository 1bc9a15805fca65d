"""StreamTable: a table whose rows come from a stream, each of them once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from datetime import date

import pyarrow as pa
import pyarrow.compute as pc

from livebode.core import LEVELS
from livebode.locations import write_whole
from livebode_plant.lake.data_file import DataFile, file_bytes, small_files
from livebode_plant.lake.lake import Change, Lake
from livebode_plant.lake.schemas import TABLES

_GROUP_ROWS = 1 << 16
"""Who reads one axis of a joined file decodes as many rows at least."""
_READERS_HOURS = 24
"""A file that is not in the table any more remains so long for those who read an older version."""
_ORDER = (*LEVELS, "log", "run", "model", "name", "logged", "logged_from", "number")


class StreamTable:
    """A table to which rows of a stream are appended; divided by days, so that old ones can be deleted at once.

    The position in the stream is stored in the commit that contains the rows (a transaction identifier of Delta), and
    a commit is a compare-and-set on the version of the table. So each row is there once, whenever a writer is killed
    and however many there are.

    Parameters
    ----------
    lake
        Where it is.
    name
        One of the tables with `days`.
    """

    def __init__(self, lake: Lake, name: str) -> None:
        self._lake, self.name, self.schema = lake, name, TABLES[name].schema
        self._place = lake.place_of(name)

    def position(self, stream: str) -> int:
        """The position that was committed last; 0 if there is none.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self._lake.reported(self.name):
            return 0 if self._lake.opened(self.name) is None else self._position(stream)

    def append(
        self, stream: str, through: int, rows: Callable[[int], pa.Table], further: Mapping[str, int] | None = None
    ) -> None:
        """Append the rows up to position `through` that are not there yet; `rows` has those after a position.

        `further` positions are stored in the same commit. Nothing is done if `through` is committed already.

        Raises
        ------
        ArchiveError
            If the table cannot be written.
        """

        def change() -> Change | None:
            position = self._position(stream)
            if position >= through:
                return None
            return Change(list(self._written(rows(position))), positions={stream: through, **(further or {})})

        self._lake.append(self.name, change)

    def read(self, columns: list[str], where: pc.Expression, since: date) -> pa.Table:
        """Rows of the days since this one; those of earlier days are not read.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self._lake.reported(self.name):
            parts = (self._lake.file_rows(file, columns, where) for file in self._files(since=since))
            return pa.concat_tables(
                [self.schema.empty_table().select(columns), *(part for part in parts if part is not None)]
            )

    def newest_first(self, columns: list[str], where: pc.Expression, since: date) -> Iterator[pa.Table]:
        """Rows file by file from the newest day on, so that a reader with little time may stop.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self._lake.reported(self.name):
            for file in reversed(self._files(since=since)):
                if (rows := self._lake.file_rows(file, columns, where)) is not None:
                    yield rows

    def delete_before(self, day: date) -> int:
        """Remove the rows of earlier days, and return the number of their files."""
        with self._lake.reported(self.name):
            while True:
                old = self._files(before=day)
                if not old or self._lake.commit(self.name, [], old):
                    return len(old)

    def join_before(self, day: date) -> int:
        """Join small files of each earlier day, sorted by axis, and return their number."""
        order = [(name, "ascending") for name in _ORDER if name in self.schema.names]

        def joined(parts: Iterator[pa.Table]) -> list[DataFile]:
            rows = pa.concat_tables([self.schema.empty_table(), *parts])
            return list(self._written(rows.sort_by(order)))

        with self._lake.reported(self.name):
            return sum(self._lake.join(self.name, group, joined) for group in small_files(self._files(before=day)))

    def remove_unused(self) -> int:
        """Remove files that have not been in the table for a day, and return their number."""
        return self._lake.remove_unused(self.name, _READERS_HOURS)

    def _position(self, stream: str) -> int:
        return self._lake.snapshot(self.name).positions.get(stream, 0)

    def _files(self, since: date = date.min, before: date = date.max) -> list[DataFile]:
        """Files of some days, in the order of the days."""
        days = [
            (file.day, file)
            for file in self._lake.files(self.name)
            if file.day is not None and since <= file.day < before
        ]
        return [file for _, file in sorted(days, key=lambda one: (one[0], one[1].name))]

    def _written(self, rows: pa.Table) -> Iterator[DataFile]:
        """Write the rows of each day to a file."""
        for day in pc.unique(rows["day"]).to_pylist():
            own = rows.filter(pc.equal(rows["day"], pa.scalar(day, pa.date32())))
            file, data = file_bytes(self.name, str(day), own, day, _GROUP_ROWS)
            write_whole(self._place / file.name, data)
            yield file
