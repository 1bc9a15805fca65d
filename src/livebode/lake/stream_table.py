"""StreamTable: a table whose rows come from a stream, each of them once."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping
from datetime import date
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from deltalake import DeltaTable
from deltalake.transaction import AddAction, RemoveAction

from livebode.core.machine_levels import LEVELS
from livebode.lake.data_file import parquet_writer
from livebode.lake.lake import Lake
from livebode.lake.schemas import TABLES
from livebode.locations import location, read_bytes, write_whole

_FILE_BYTES_MIN, _FILE_BYTES_MAX = 32 << 20, 128 << 20
"""Smaller files of a day are joined, up to the larger size together."""
_GROUP_ROWS = 1 << 16
"""Who reads one axis of a joined file decodes as many rows at least."""
_READERS_HOURS = 24
"""A file that is not in the table any more remains so long for those who read an older version."""
_ORDER = (*LEVELS, "log", "run", "model", "name", "logged", "logged_from", "number")


class _File(NamedTuple):
    """A file of one day, in the directory of the table."""

    name: str
    day: date
    size_bytes: int
    rows: int

    def added(self, *, changed: bool = True) -> AddAction:
        statistics = json.dumps({"numRecords": self.rows})  # without limits: see `DataFile.statistics`
        return AddAction(self.name, self.size_bytes, self._partition, _now_ms(), changed, statistics)

    def removed(self, *, changed: bool = True) -> RemoveAction:
        return RemoveAction(self.name, changed, _now_ms(), self.size_bytes, self._partition)

    @property
    def _partition(self) -> dict[str, str | None]:
        return {"day": str(self.day)}


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
        place = location(lake.url)
        self._place = (place.absolute() if isinstance(place, Path) else place) / name

    def position(self, stream: str) -> int:
        """The position that was committed last; 0 if there is none.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self._lake.reported(self.name):
            table = self._lake.opened(self.name)
            return 0 if table is None else _position(table, stream)

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
        with self._lake.reported(self.name):
            table = self._lake.created(self.name)
            while (at := _position(table, stream)) < through:
                positions = {stream: through, **(further or {})}
                if self._lake.commit(table, self.name, [file.added() for file in self._written(rows(at))], positions):
                    return

    def read(self, columns: list[str], where: pc.Expression, since: date) -> pa.Table:
        """Rows of the days since this one; those of earlier days are not read.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self._lake.reported(self.name):
            table = self._lake.opened(self.name)
            if table is None:
                return self.schema.empty_table().select(columns)
            parts = [self._part(file, columns, where) for file in _files(table) if file.day >= since]
            return pa.concat_tables([self.schema.empty_table().select(columns), *parts])

    def newest_first(self, columns: list[str], where: pc.Expression, since: date) -> Iterator[pa.Table]:
        """The same file by file from the newest day on, so that a reader with little time may stop.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self._lake.reported(self.name):
            table = self._lake.opened(self.name)
            files = [] if table is None else [file for file in _files(table) if file.day >= since]
            for file in sorted(files, key=lambda file: file.day, reverse=True):
                yield self._part(file, columns, where)

    def delete_before(self, day: date) -> int:
        """Remove the rows of earlier days, and return the number of their files."""
        with self._lake.reported(self.name):
            while (table := self._lake.opened(self.name)) is not None:
                old = [file for file in _files(table) if file.day < day]
                if not old or self._lake.commit(table, self.name, [file.removed() for file in old]):
                    return len(old)
            return 0

    def join_before(self, day: date) -> int:
        """Join small files of each earlier day, sorted by axis, and return their number."""
        joined = 0
        with self._lake.reported(self.name):
            table = self._lake.opened(self.name)
            if table is None:
                return 0
            order = [(name, "ascending") for name in _ORDER if name in self.schema.names]
            for group in _groups([file for file in _files(table) if file.day < day]):
                rows = pa.concat_tables(self._part(file, self.schema.names, None) for file in group).sort_by(order)
                actions = [file.added(changed=False) for file in self._written(rows)]
                if self._lake.commit(table, self.name, [*(file.removed(changed=False) for file in group), *actions]):
                    joined += len(group)
        return joined

    def vacuum(self) -> int:
        """Delete files that have not been in the table for a day, and return their number."""
        with self._lake.reported(self.name):
            table = self._lake.opened(self.name)
            if table is None:
                return 0
            return len(table.vacuum(_READERS_HOURS, dry_run=False, enforce_retention_duration=False, full=True))

    def _part(self, file: _File, columns: list[str], where: pc.Expression | None) -> pa.Table:
        place = self._place / file.name
        # Of a file here only the columns and the groups of rows that may match are read.
        source = place if isinstance(place, Path) else pa.BufferReader(read_bytes(place))
        return pq.read_table(source, columns=columns, filters=where, schema=self.schema, partitioning=None)

    def _written(self, rows: pa.Table) -> Iterator[_File]:
        """Write the rows of each day to a file."""
        for day in pc.unique(rows["day"]).to_pylist():
            own = rows.filter(pc.equal(rows["day"], pa.scalar(day, pa.date32())))
            buffer = pa.BufferOutputStream()
            with parquet_writer(buffer, self.schema) as writer:
                writer.write_table(own.cast(self.schema), row_group_size=_GROUP_ROWS)
            data = buffer.getvalue().to_pybytes()
            name = f"{day}-{hashlib.sha256(data).hexdigest()}.parquet"
            write_whole(self._place / name, data)
            yield _File(name, day, len(data), own.num_rows)


def _position(table: DeltaTable, stream: str) -> int:
    return table.transaction_version(stream) or 0


def _files(table: DeltaTable) -> list[_File]:
    actions = pa.table(table.get_add_actions(flatten=True))
    columns = (actions[name].to_pylist() for name in ("path", "partition.day", "size_bytes", "num_records"))
    return sorted(_File(*one) for one in zip(*columns))


def _groups(files: list[_File]) -> Iterator[list[_File]]:
    """Small files of each day, as many together as may be joined in memory."""
    group: list[_File] = []
    for file in sorted((file for file in files if file.size_bytes < _FILE_BYTES_MIN), key=lambda file: file.day):
        full = sum(one.size_bytes for one in group) + file.size_bytes > _FILE_BYTES_MAX
        if group and (full or file.day != group[0].day):
            yield from [group] * (len(group) > 1)
            group = []
        group.append(file)
    yield from [group] * (len(group) > 1)


def _now_ms() -> int:
    return time.time_ns() // 1_000_000
