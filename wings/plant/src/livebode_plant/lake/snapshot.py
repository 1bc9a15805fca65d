"""Snapshot: what a version of a table consists of, proven by the digest that its last commit contains."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

import pyarrow as pa
from deltalake import CommitProperties, DeltaTable, Transaction

from livebode_plant.lake.data_file import DataFile

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
            entry = json.loads(next(one["commitInfo"] for one in actions if "commitInfo" in one)[_ENTRY])
            digest, streams = entry["digest"], [str(stream) for stream in entry["streams"]]
        except (KeyError, TypeError, ValueError, StopIteration, RecursionError):
            raise DamagedTableError(f"version {table.version()} has no digest") from None
        positions = {stream: table.transaction_version(stream) or 0 for stream in streams}
        files = {file.name: file for file in _files(name, table)}
        found = cls(name, tuple(field.name for field in table.schema().fields), files, positions)
        if found._digest != digest:
            raise DamagedTableError(f"the digest in version {table.version()} is not that of its files")
        return found

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
        new = [Transaction(stream, at) for stream, at in (positions or {}).items()]
        return CommitProperties({_ENTRY: entry}, max_commit_retries=0, app_transactions=new)

    @property
    def _digest(self) -> str:
        files = sorted((one.name, one.size_bytes, one.rows, str(one.day)) for one in self.files.values())
        content = [self.table, self.columns, files, sorted(self.positions.items())]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _files(name: str, table: DeltaTable) -> list[DataFile]:
    actions = pa.table(table.get_add_actions(flatten=True))
    none: list[Any] = [None] * actions.num_rows
    columns = ("path", "size_bytes", "num_records", "partition.day")
    values = [actions[one].to_pylist() if one in actions.column_names else none for one in columns]
    files = [DataFile(name, *one) for one in zip(*values)]
    for file in files:
        try:
            file.of  # noqa: B018 - checks the name
        except ValueError as error:
            raise DamagedTableError(str(error)) from None
    return files
