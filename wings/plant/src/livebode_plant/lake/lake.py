"""Lake: the tables below one URL, and the commits to them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
from deltalake import DeltaTable
from deltalake.exceptions import CommitFailedError, DeltaError, TableNotFoundError

from livebode.core import ArchiveError, whole_file
from livebode.locations import find, make_parent, opened, read_bytes, reporting, write_whole
from livebode_plant.lake.data_file import DamagedTableError, DataFile, Key, Snapshot, file_bytes
from livebode_plant.lake.schemas import TABLES
from livebode_plant.lake.table_content import FOLDER, LOG, TableContent
from livebode_plant.lake.table_directory import check_directory, check_names, delta_options, remove_data

Row = tuple[Any, ...]


class Change(NamedTuple):
    """Files that a commit adds to a table and removes from it, and positions in streams that it contains."""

    added: Sequence[DataFile]
    removed: Sequence[DataFile] = ()
    positions: Mapping[str, int] | None = None


class Lake(TableContent):
    """The results of an archive; the tables are created when something is written.

    A commit is a compare-and-set on the version of its table: what another process has written is known before
    anything is added, so no row is there twice, however many processes write and whenever one is killed.

    Parameters
    ----------
    url
        Directory, or URL such as s3://plant/lake. Credentials come from the environment.
    """

    def __init__(self, url: str) -> None:
        super().__init__(url)
        self._tables: dict[str, DeltaTable] = {}
        self._snapshots: dict[str, tuple[int, Snapshot]] = {}
        self._known: dict[str, tuple[int, set[Row]]] = {}

    def check(self, *names: str) -> None:
        """Check that the directories of these tables, or of all, have nothing that livebode did not write.

        Of a lake at a URL only what `remove_unused` would remove is checked.

        Raises
        ------
        ArchiveError
            If one has anything else, or is a link.
        """
        if isinstance(self._place, Path):
            for name in names or TABLES:
                check_directory(self._place, name)

    def remove_unused(self, name: str, after_hours: int) -> int:
        """Remove files that have not been in a table for this time, and return their number.

        Raises
        ------
        ArchiveError
            If the table cannot be read, or its directory has anything that livebode did not write. Nothing is removed
            then.
        """
        self.check(name)
        with self.reported(name):
            if (table := self.opened(name)) is None:
                return 0
            place = self.place_of(name)
            # A dry run: which files may be removed is deltalake's to say, and the removal is not.
            unused = table.vacuum(after_hours, dry_run=True, enforce_retention_duration=False, full=True)
            check_names(name, str(place), unused)
            remove_data(place, name, unused, TABLES[name].schema)
            return len(unused)

    def read(self, name: str, columns: Sequence[str] | None = None, where: pc.Expression | None = None) -> pa.Table:
        """The rows of a table as they are now, in no order; none if nothing was written yet.

        Rows of results that are not complete are included; see `counted`. A damaged file is left out with a
        `DamageWarning`.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self.reported(name):
            return self._reported_rows(name, self.files(name), columns, where)

    def counted(
        self,
        name: str,
        columns: Sequence[str] | None = None,
        where: pc.Expression | None = None,
        runs: pc.Expression | None = None,
    ) -> pa.Table:
        """Rows as of `read`, but only of results that count: those with a row in `runs`, or in a part of that table.

        Raises
        ------
        ArchiveError
            If a table cannot be read.
        """
        rows, keys = self.read(name, columns, where), self.read("runs", Key._fields, runs)
        return rows.filter(pc.is_in(_key_words(rows), value_set=_key_words(keys).combine_chunks()))

    def lazy_rows(self, name: str) -> ds.Dataset | None:
        """The rows of a table as they are now, not read yet; None if nothing was written.

        Call `report_damage` when they were read.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self.reported(name):
            return None if self.opened(name) is None else self.dataset(name, self.files(name))

    def rows_of(self, name: str, key: Key) -> pa.Table:
        """The rows of one result in a table of responses, parameters or events, read from as few files as possible.

        They are in the order in which they were tracked. A damaged file is left out with a `DamageWarning`.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        where = (pc.field("content") == key.content) & (pc.field("recipe") == key.recipe)
        with self.reported(name):
            files = self.files(name)
            own = [file for file in files if file.key == key]
            chosen = own or [file for file in files if file.key is None]
            return self._reported_rows(name, chosen, None, where).sort_by("sample")

    def file_rows(self, file: DataFile, columns: Sequence[str] | None = None, where: Any = None) -> pa.Table | None:
        """The rows of one file of a table; None, and a `DamageWarning`, if it is damaged."""
        rows = self._reported_rows(file.table, [file], columns, where)
        return None if self.damage(file.table, file.name) else rows

    def keys(self, name: str) -> set[Row]:
        """The keys of the rows of a table.

        Raises
        ------
        ArchiveError
            If the table cannot be read, or a file of it is damaged: what its rows are is not known then.
        """
        with self.reported(name):
            return self._keys(name)

    def files(self, name: str) -> list[DataFile]:
        """The files of a table at its newest version; none if it does not exist."""
        return [] if self.opened(name) is None else list(self.snapshot(name).files.values())

    def add_rows(self, name: str, rows: pa.Table) -> int:
        """Append the rows whose key is not in the table, and return their number."""
        own, new, present = _rows_of(rows, TABLES[name].key), rows, set[Row]()

        def change() -> Change | None:
            nonlocal new, present
            present = self._keys(name)
            new = rows.filter(pa.array([key not in present for key in own], pa.bool_()))
            if not new.num_rows:
                return None
            file, data = file_bytes(name, "rows", new)
            write_whole(self.place_of(name) / file.name, data)
            return Change([file])

        if not self.append(name, change):
            return 0
        present.update(own)  # in place: the keys of the table are not read again
        self._known[name] = self._tables[name].version(), present
        return int(new.num_rows)

    def add_files(self, name: str, files: Sequence[DataFile]) -> None:
        """Add files that are in the table's directory already, except those of results that count already.

        Another file of the same result, for example of another version of livebode, is replaced. A result counts once
        it has a row in `runs`.
        """

        def change() -> Change | None:
            counted = self.keys("runs")
            new = [file for file in files if file.rows and file.key not in counted]
            keys = {file.key for file in new}
            return Change(new, [file for file in self.files(name) if file.key in keys]) if new else None

        if files:
            self.append(name, change)

    def append(self, name: str, change: Callable[[], Change | None]) -> bool:
        """Commit a change of the newest version of a table: the one way in which rows come into a lake.

        Where another process has committed in the same moment, the change is asked for again. False if there is none,
        or if the log of an advisory table is damaged.

        Raises
        ------
        ArchiveError
            If the table cannot be written.
        """
        with self.reported(name):
            while True:
                self.created(name)
                if self.damage(name) or (new := change()) is None:
                    return False
                if self.commit(name, *new):
                    return True

    def store(self, file: DataFile, content: bytes | Path) -> None:
        """Put a file, of these bytes or those at a path, in the directory of its table, completely or not at all.

        Raises
        ------
        ArchiveError, LocationError
            If it cannot be written.
        """
        target = self.place_of(file.table) / file.name
        if isinstance(target, Path):
            with self.reported(file.table):
                target.parent.mkdir(parents=True, exist_ok=True)
                with whole_file(target) as partial:
                    partial.write_bytes(content) if isinstance(content, bytes) else shutil.copyfile(content, partial)
            return
        system, inside = opened(target)
        with reporting(target):
            make_parent(target, system, inside)
            if isinstance(content, bytes):
                system.pipe_file(inside, content)
            else:
                system.put_file(str(content), inside)

    def commit(
        self,
        name: str,
        added: Sequence[DataFile],
        removed: Sequence[DataFile] = (),
        positions: Mapping[str, int] | None = None,
        *,
        changed: bool = True,
    ) -> bool:
        """Commit in the version after the one that was read; False if somebody else has written that one.

        The `positions` in streams are stored in the same commit. Not `changed`: the same rows are in other files.
        """
        table, kind = self._tables[name], TABLES[name]
        before, after = table.version(), self.snapshot(name).after(added, removed, positions)
        names = {file.name for file in added}
        actions = [file.removed(changed=changed) for file in removed if file.name not in names]
        try:
            table.create_write_transaction(
                [*actions, *(file.added(changed=changed) for file in added)], "append", kind.schema,
                partition_by=kind.partitions, commit_properties=after.commit_properties(positions),
            )  # fmt: skip
        except CommitFailedError:
            table.update_incremental()
            if table.version() == before:
                raise
            return False
        self._snapshots[name] = before + 1, after
        table.update_incremental()
        return True

    def join(self, name: str, files: Sequence[DataFile], joined: Callable[[Iterator[pa.Table]], list[DataFile]]) -> int:
        """Replace files by others with the same rows, which `joined` writes; the number of files that were replaced.

        A damaged file is left in the table as it is, with a `DamageWarning`.
        """
        whole: list[DataFile] = []

        def parts() -> Iterator[pa.Table]:
            for file in files:
                if (rows := self.file_rows(file)) is not None:
                    whole.append(file)
                    yield rows

        written = joined(parts())
        while len(whole) > 1 and {file.name for file in whole} <= self.snapshot(name).files.keys():
            if self.commit(name, written, whole, changed=False):
                return len(whole)
        return 0

    def _keys(self, name: str) -> set[Row]:
        if self.opened(name) is None:
            return set()
        version, keys = self._known.get(name, (-1, set()))
        if version != self._tables[name].version():
            key, files = TABLES[name].key, self.files(name)
            keys = set(_rows_of(self.rows(name, files, key), key))
            damaged = [file.name for file in files if self.damage(name, file.name)]
            if damaged and not TABLES[name].advisory:
                raise DamagedTableError(f"its file {damaged[0]} {self.damage(name, damaged[0])}")
            self.report_damage()
            self._known[name] = (self._tables[name].version(), keys)
        return keys

    def _reported_rows(
        self, name: str, files: Sequence[DataFile], columns: Sequence[str] | None, where: pc.Expression | None
    ) -> pa.Table:
        """Rows of files, with a `DamageWarning` for those that are damaged."""
        rows = self.rows(name, files, columns, where)
        self.report_damage()
        return rows

    def exists(self, name: str) -> bool:
        """Whether there is a table, readable or not.

        Raises
        ------
        LocationError
            If the storage does not answer.
        """
        log = self.place_of(name) / LOG
        return any(log.glob("*.json")) if isinstance(log, Path) else bool(find(f"{log.address}/*.json"))

    def snapshot(self, name: str) -> Snapshot:
        """What a table that was opened consists of at its newest version."""
        table = self._tables[name]
        version, snapshot = self._snapshots.get(name, (-1, None))
        if snapshot is None or version != table.version():
            version = table.version()
            snapshot = Snapshot.read(name, table, read_bytes(self.place_of(name) / LOG / f"{version:020}.json"))
            self._snapshots[name] = version, snapshot
        return snapshot

    def opened(self, name: str) -> DeltaTable | None:
        """The table at its newest version; None if it does not exist, or is advisory and its log is damaged."""
        try:
            with self._readable(name):
                if name in self._tables:
                    self._tables[name].update_incremental()
                else:
                    self._tables[name] = self._table(name)
                self.snapshot(name)
        except TableNotFoundError:
            self._tables.pop(name, None)
            return None
        except DamagedTableError as error:
            if not TABLES[name].advisory:
                raise
            self.set_damage(name, LOG, f"is damaged: {error}")
            self.report_damage()
            return None
        return self._tables[name]

    def created(self, name: str) -> None:
        """Open the table at its newest version, which may be a new one."""
        if self.opened(name) is not None or self.damage(name):
            return
        kind = TABLES[name]
        new = Snapshot(name, tuple(kind.schema.names), {}, {})
        with suppress(CommitFailedError):  # another process has created it in the same moment
            DeltaTable.create(
                self._uri(name), kind.schema, mode="ignore", partition_by=kind.partitions,
                storage_options=delta_options(self._place), commit_properties=new.commit_properties(),
            )  # fmt: skip
        self._tables[name] = self._table(name)

    def _table(self, name: str) -> DeltaTable:
        uri, options = self._uri(name), delta_options(self._place)
        try:
            return DeltaTable(uri, storage_options=options)
        except TableNotFoundError:
            if not self.exists(name):
                raise
        try:
            return DeltaTable(uri, storage_options=options)  # another process has created it in the same moment
        except TableNotFoundError as error:
            raise DamagedTableError(str(error)) from error

    def _uri(self, name: str) -> str:
        place = self.place_of(name)
        return str(place) if isinstance(place, Path) else place.address

    @contextmanager
    def _readable(self, name: str) -> Iterator[None]:
        """Within, what deltalake raises where it cannot read a log is a `DamagedTableError`, if the storage answers."""
        try:
            yield
        except (DamagedTableError, TableNotFoundError, OSError):
            raise
        except BaseException as error:
            # A panic of Rust is no Exception.
            if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
                raise
            self._tables.pop(name, None)
            if not self.exists(name):
                raise
            raise DamagedTableError((str(error).splitlines() or [type(error).__name__])[0]) from error

    @contextmanager
    def reported(self, name: str) -> Iterator[None]:
        """Within, an error of a table is an ArchiveError that names it."""
        try:
            yield
        except DamagedTableError as error:
            raise ArchiveError(
                "lake-damaged",
                f"the table {name} of the lake {self.url!r} is damaged: {error}",
                f"restore its directory {FOLDER}/{name} from a backup, or track the recordings into a new lake",
                lake=self.url,
                table=name,
                reason=str(error),
            ) from error
        except (DeltaError, OSError, pa.ArrowInvalid) as error:
            raise ArchiveError(
                "lake-unusable",
                f"the table {name} of the lake {self.url!r} cannot be used: {str(error).splitlines()[0]}",
                "check the address, the permissions and the credentials in the environment",
                lake=self.url,
                table=name,
                reason=str(error),
            ) from error


def _rows_of(table: pa.Table, columns: Sequence[str]) -> list[Row]:
    return list(zip(*(table[name].to_pylist() for name in columns)))


def _key_words(rows: pa.Table) -> pa.ChunkedArray:
    """Key of each row in one word."""
    return pc.binary_join_element_wise(*(rows[name] for name in Key._fields), "/")
