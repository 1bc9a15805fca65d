"""DataFile: a Parquet file of a table, whose name has the SHA-256 of its bytes; Snapshot: the files of a version."""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from datetime import date
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from deltalake import CommitProperties, DeltaTable, Transaction
from deltalake.transaction import AddAction, RemoveAction

from livebode.dataclass import dataclass
from livebode.tables import text
from livebode_plant.lake.schemas import TABLES
from livebode_plant.lake.wide_responses import wide_options

JOINED: Final = "part"
"""What is in a file of several results: begin of its name."""
_NAME: Final = re.compile(r"([\w-]+)-([0-9a-f]{64})\.parquet", re.ASCII)
_GROUP_BYTES = 4 << 20
_SMALL_BYTES, _JOINED_BYTES_MAX = 32 << 20, 128 << 20
"""Smaller files are joined, up to the larger size together."""


class Key(NamedTuple):
    """What a result belongs to: the recording by its content, and the settings by the recipe's id."""

    content: str
    recipe: str


@dataclass(frozen=True)
class DataFile:
    """A file in the directory of a table.

    Attributes
    ----------
    table
        Name of the table.
    name
        Of the file: what it contains, and the SHA-256 of its bytes. The same rows have the same one.
    size_bytes, rows
        For the table's log.
    day
        Of the rows, in a table that is divided by days.
    """

    table: str
    name: str
    size_bytes: int
    rows: int
    day: date | None = None

    @property
    def of(self) -> str:
        """What it contains: CONTENT-RECIPE of one result, a day, "rows", or "part" of a joined file.

        ValueError if no lake has a file of this name, for example one that leads out of the table's directory.
        """
        return self._parts[0]

    @property
    def sha256(self) -> str:
        """SHA-256 of its bytes, in hexadecimal digits."""
        return self._parts[1]

    @property
    def key(self) -> Key | None:
        """The result that it contains; None if there are several."""
        content, _, recipe = self.of.partition("-")
        return Key(content, recipe) if recipe and self.day is None else None

    def added(self, *, changed: bool = True) -> AddAction:
        """The action that adds it to the table; not `changed`: its rows were in other files.

        Without the limits of columns: deltalake reads a column whose limits are missing as one between null and null,
        so a filter on it finds no row as soon as another column has limits. The limits in the Parquet file are used.
        """
        statistics = json.dumps({"numRecords": self.rows})
        return AddAction(self.name, self.size_bytes, self._partition, _now_ms(), changed, statistics)

    def removed(self, *, changed: bool = True) -> RemoveAction:
        """The action that removes it from the table."""
        return RemoveAction(self.name, changed, _now_ms(), self.size_bytes, self._partition)

    @property
    def _parts(self) -> tuple[str, str]:
        if (match := _NAME.fullmatch(self.name)) is None:
            raise ValueError(f"{self.name[:200]!r} is not the name of a file in this table")
        return match[1], match[2]

    @property
    def _partition(self) -> dict[str, str | None]:
        return {} if self.day is None else {"day": str(self.day)}


class DataFileWriter:
    """Writes rows, as they come, to a file of a table. A context manager.

    Row groups have a bounded size, and follow from the rows alone. A file of one group is never on the disk.

    Parameters
    ----------
    folder
        An existing directory for a file of several groups.
    table
        Of the lake.
    of
        What it contains: `DataFile.of`.

    Attributes
    ----------
    content
        The bytes of the file, or its path, when it is finished.
    """

    def __init__(self, folder: Path, table: str, of: str) -> None:
        self._path, self._table, self._of = folder / f"{table}.parquet", table, of
        self._schema = TABLES[table].schema
        self._writer: pq.ParquetWriter | None = None
        self._waiting: list[pa.Table] = []
        self._waiting_bytes = self._rows = 0
        self.content: bytes | Path = self._path

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._writer is not None:
            self._writer.close()

    def write(self, rows: pa.Table) -> None:
        """Append rows; a column that they lack is null."""
        self._waiting.append(pa.table([_column(rows, field) for field in self._schema], schema=self._schema))
        self._rows += rows.num_rows
        self._waiting_bytes += rows.nbytes
        if self._waiting_bytes >= _GROUP_BYTES:
            if self._writer is None:
                self._writer = parquet_writer(self._path, self._schema)
            self._flush(self._writer)

    def finish(self) -> DataFile:
        """Complete the file, and name it."""
        if self._writer is None:
            buffer = pa.BufferOutputStream()
            with parquet_writer(buffer, self._schema) as writer:
                self._flush(writer)
            self.content = content = buffer.getvalue().to_pybytes()
            size_bytes, sha256 = len(content), hashlib.sha256(content).hexdigest()
        else:
            self._flush(self._writer)
            self._writer.close()
            with self._path.open("rb") as written:
                size_bytes, sha256 = self._path.stat().st_size, hashlib.file_digest(written, "sha256").hexdigest()
        return DataFile(self._table, _named(self._of, sha256), size_bytes, self._rows)

    def _flush(self, writer: pq.ParquetWriter) -> None:
        if self._waiting:
            whole = pa.concat_tables(self._waiting)
            self._waiting, self._waiting_bytes = [], 0
            writer.write_table(whole, row_group_size=max(whole.num_rows, 1))


class ResultFileWriter(DataFileWriter):
    """Writes the rows of one result, without the key's columns, which it adds."""

    def __init__(self, folder: Path, table: str, key: Key) -> None:
        super().__init__(folder, table, "-".join(key))
        self._key = key

    def write(self, rows: pa.Table) -> None:
        """Append rows without the key's columns; a column that they lack is null."""
        own = {name: rows[name] for name in rows.column_names}
        own |= {
            name: text([word], np.zeros(rows.num_rows, dtype=np.int64)) for name, word in self._key._asdict().items()
        }
        super().write(pa.table(own))


def _column(rows: pa.Table, field: pa.Field[Any]) -> Any:
    if field.name in rows.column_names:
        column = rows[field.name]
        return column if column.type == field.type else column.cast(field.type)
    return pa.nulls(rows.num_rows, field.type)


def parquet_writer(path: Path | pa.BufferOutputStream, schema: pa.Schema) -> pq.ParquetWriter:
    """A Parquet file with the layout of wide responses, without Arrow's own schema: a lake has one for all files."""
    return pq.ParquetWriter(path, schema, store_schema=False, **wide_options(schema))


def file_bytes(
    table: str, of: str, rows: pa.Table, day: date | None = None, group_rows: int | None = None
) -> tuple[DataFile, bytes]:
    """A file with these rows, and its bytes."""
    buffer, schema = pa.BufferOutputStream(), TABLES[table].schema
    with parquet_writer(buffer, schema) as writer:
        writer.write_table(rows.cast(schema), row_group_size=group_rows)
    data = buffer.getvalue().to_pybytes()
    return DataFile(table, _named(of, hashlib.sha256(data).hexdigest()), len(data), rows.num_rows, day), data


def small_files(files: Iterable[DataFile]) -> Iterator[list[DataFile]]:
    """Small files of each day, as many together as may be joined in memory."""
    group: list[DataFile] = []
    small = (file for file in files if file.size_bytes < _SMALL_BYTES)
    for file in sorted(small, key=lambda file: (str(file.day), file.name)):
        full = sum(member.size_bytes for member in group) + file.size_bytes > _JOINED_BYTES_MAX
        if group and (full or file.day != group[0].day):
            yield from [group] * (len(group) > 1)
            group = []
        group.append(file)
    yield from [group] * (len(group) > 1)


def _named(of: str, sha256: str) -> str:
    return f"{of}-{sha256}.parquet"


def _now_ms() -> int:
    return time.time_ns() // 1_000_000


_ENTRY: Final = "livebode"
"""Name of livebode's entry in a commit."""


class DamagedTableError(Exception):
    """A table, most often its log, is damaged."""


@dataclass(frozen=True)
class Snapshot:
    """What a version of a table consists of.

    A flipped bit in a log of Delta, or in a checkpoint of it, can drop a file, add a removed one again or change a
    position without an error. So each commit contains a digest of all that the table consists of after it.

    Attributes
    ----------
    table
        Name of the table.
    columns
        Names of its columns.
    files
        By name.
    positions
        In streams.
    """

    table: str
    columns: tuple[str, ...]
    files: Mapping[str, DataFile]
    positions: Mapping[str, int]

    @classmethod
    def read(cls, name: str, table: DeltaTable, commit: bytes) -> Self:
        """What the log says, which is compared with the digest in the last `commit`.

        Raises
        ------
        DamagedTableError
            If they differ, or the log names a file that is not in the directory of the table.
        """
        try:
            actions = [json.loads(line) for line in commit.splitlines()]
            entry = json.loads(next(action["commitInfo"] for action in actions if "commitInfo" in action)[_ENTRY])
            digest, streams = entry["digest"], [str(stream) for stream in entry["streams"]]
        except (KeyError, TypeError, ValueError, StopIteration, RecursionError):
            raise DamagedTableError(f"version {table.version()} has no digest") from None
        positions = {stream: table.transaction_version(stream) or 0 for stream in streams}
        files = {file.name: file for file in _files(name, table)}
        snapshot = cls(name, tuple(field.name for field in table.schema().fields), files, positions)
        if snapshot._digest != digest:
            raise DamagedTableError(f"the digest in version {table.version()} is not that of its files")
        return snapshot

    def after(
        self, added: Iterable[DataFile], removed: Iterable[DataFile], positions: Mapping[str, int] | None = None
    ) -> Self:
        """What the table consists of after a commit."""
        names = {file.name for file in removed}
        files = {name: file for name, file in self.files.items() if name not in names}
        files |= {file.name: file for file in added}
        return type(self)(self.table, self.columns, files, {**self.positions, **(positions or {})})

    def commit_properties(self, positions: Mapping[str, int] | None = None) -> CommitProperties:
        """Properties of the commit that leads to this, with these new positions."""
        entry = json.dumps({"digest": self._digest, "streams": sorted(self.positions)})
        new = [Transaction(stream, position) for stream, position in (positions or {}).items()]
        return CommitProperties({_ENTRY: entry}, max_commit_retries=0, app_transactions=new)

    @property
    def _digest(self) -> str:
        files = sorted((file.name, file.size_bytes, file.rows, str(file.day)) for file in self.files.values())
        content = [self.table, self.columns, files, sorted(self.positions.items())]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _files(name: str, table: DeltaTable) -> list[DataFile]:
    actions = pa.table(table.get_add_actions(flatten=True))
    none: list[Any] = [None] * actions.num_rows
    columns = ("path", "size_bytes", "num_records", "partition.day")
    values = [actions[column].to_pylist() if column in actions.column_names else none for column in columns]
    files = [DataFile(name, *column) for column in zip(*values)]
    for file in files:
        try:
            file.of  # noqa: B018 - checks the name
        except ValueError as error:
            raise DamagedTableError(str(error)) from None
    return files
