"""Lake: the tables below one URL, and the commits to them."""

from __future__ import annotations

import hashlib
import shutil
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from deltalake import DeltaTable
from deltalake.exceptions import CommitFailedError, DeltaError, TableNotFoundError
from pyarrow.fs import FileSystem, LocalFileSystem, PyFileSystem, SubTreeFileSystem

from livebode.core import ArchiveError, DamageWarning, LocationError, whole_file
from livebode.locations import (
    Location,
    find,
    location,
    make_parent,
    opened,
    read_bytes,
    reporting,
    write_whole,
)
from livebode.records import VerifiedFiles
from livebode_plant.lake.data_file import DamagedTableError, DataFile, Key, Snapshot, file_bytes
from livebode_plant.lake.schemas import TABLES
from livebode_plant.lake.table_directory import check_directory, check_names, delta_options, remove_data

Row = tuple[Any, ...]
FOLDER = "tables"
"""Directory of the tables in that of the lake, where a user may have other files too."""
_DOWNLOADS = 8
_LOG = "_delta_log"


class Lake:
    """The results of an archive; the tables are created when something is written.

    A commit is a compare-and-set on the version of its table: what another process has written is known before
    anything is added, so no row is there twice, however many processes write and whenever one is killed.

    Parameters
    ----------
    url
        Directory, or URL such as s3://plant/lake. Credentials come from the environment.
    """

    def __init__(self, url: str) -> None:
        place = location(url)
        self._place: Location = (place.absolute() if isinstance(place, Path) else place) / FOLDER
        self.url = str(place)
        self._tables: dict[str, DeltaTable] = {}
        self._snapshots: dict[str, tuple[int, Snapshot]] = {}
        self._known: dict[str, tuple[int, set[Row]]] = {}
        self._verified: set[tuple[str, str]] = set()
        self._damaged: dict[tuple[str, str], str] = {}
        self._warned: set[tuple[str, str]] = set()

    def place_of(self, name: str) -> Location:
        """The directory of a table."""
        return self._place / name

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

        Rows of results that are not complete are included; see `quantities`. A damaged file is left out with a
        `DamageWarning`.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self.reported(name):
            return self._reported_rows(name, self._files(name), columns, where)

    def rows(self, name: str) -> ds.Dataset | None:
        """The rows of a table as they are now, not read yet; None if nothing was written.

        Call `report_damage` when they were read.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self.reported(name):
            if self.opened(name) is None:
                return None
            files, schema = {file.name: file for file in self._files(name)}, TABLES[name].schema
            opened = VerifiedFiles(schema, lambda path: self._whole(files[path]))
            return _dataset(files.values(), schema, PyFileSystem(opened))

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
            files = self._files(name)
            own = [file for file in files if file.key == key]
            chosen = own or [file for file in files if file.key is None]
            return self._reported_rows(name, chosen, None, where).sort_by("sample")

    def file_rows(self, file: DataFile, columns: Sequence[str] | None = None, where: Any = None) -> pa.Table | None:
        """The rows of one file of a table; None, and a `DamageWarning`, if it is damaged."""
        found = self._reported_rows(file.table, [file], columns, where)
        return None if (file.table, file.name) in self._damaged else found

    def quantities(self) -> pa.Table:
        """The quantities of the results that count, those with a row in `runs`."""
        key = TABLES["runs"].key
        found, counted = self.read("quantities"), set(_rows_of(self.read("runs", key), key))
        keys = zip(found["content"].to_pylist(), found["recipe"].to_pylist())
        return found.filter(pa.array([key in counted for key in keys], pa.bool_()))

    def keys(self, name: str) -> set[Row]:
        """The keys of the rows of a table.

        Raises
        ------
        ArchiveError
            If the table cannot be read, or a file of it is damaged: what its rows are is not known then.
        """
        with self.reported(name):
            return self._keys(name)

    def add_rows(self, name: str, rows: pa.Table) -> int:
        """Append the rows whose key is not in the table, and return their number."""
        with self.reported(name):
            while True:
                self.created(name)
                if (name, _LOG) in self._damaged:
                    return 0
                present, own = self._keys(name), _rows_of(rows, TABLES[name].key)
                new = rows.filter(pa.array([key not in present for key in own], pa.bool_()))
                if not new.num_rows:
                    return 0
                file, data = file_bytes(name, "rows", new)
                write_whole(self.place_of(name) / file.name, data)
                if self.commit(name, [file]):
                    present.update(own)
                    self._known[name] = (self._tables[name].version(), present)
                    return int(new.num_rows)

    def add_files(self, name: str, files: Sequence[DataFile]) -> None:
        """Add files that are in the table's directory already, except those of results that count already.

        Another file of the same result, for example of another version of livebode, is replaced. A result counts once
        it has a row in `runs`.
        """
        with self.reported(name):
            while files:
                self.created(name)
                counted = self.keys("runs")
                files = [file for file in files if file.rows and file.key not in counted]
                keys = {file.key for file in files}
                if not files or self.commit(name, files, [file for file in self._files(name) if file.key in keys]):
                    return

    def store(self, path: Path, table: str) -> None:
        """Put a file in the directory of a table, completely or not at all.

        Raises
        ------
        ArchiveError, LocationError
            If it cannot be written.
        """
        target = self.place_of(table) / path.name
        if isinstance(target, Path):
            with self.reported(table):
                target.parent.mkdir(parents=True, exist_ok=True)
                with whole_file(target) as partial:
                    shutil.copyfile(path, partial)
            return
        system, inside = opened(target)
        with reporting(target):
            make_parent(target, system, inside)
            system.put_file(str(path), inside)

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
        table, one = self._tables[name], TABLES[name]
        before, after = table.version(), self.snapshot(name).after(added, removed, positions)
        names = {file.name for file in added}
        actions = [file.removed(changed=changed) for file in removed if file.name not in names]
        try:
            table.create_write_transaction(
                [*actions, *(file.added(changed=changed) for file in added)], "append", one.schema,
                partition_by=one.partitions, commit_properties=after.commit_properties(positions),
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
        version, found = self._known.get(name, (-1, set()))
        if version != self._tables[name].version():
            key, files = list(TABLES[name].key), self._files(name)
            found = set(_rows_of(self._rows(name, files, key), key))
            damaged = [file.name for file in files if (name, file.name) in self._damaged]
            if damaged and not TABLES[name].advisory:
                raise DamagedTableError(f"its file {damaged[0]} {self._damaged[name, damaged[0]]}")
            self.report_damage()
            self._known[name] = (self._tables[name].version(), found)
        return found

    def _files(self, name: str) -> list[DataFile]:
        return [] if self.opened(name) is None else list(self.snapshot(name).files.values())

    def _reported_rows(
        self, name: str, files: Sequence[DataFile], columns: Sequence[str] | None, where: pc.Expression | None
    ) -> pa.Table:
        """Rows of files, with a `DamageWarning` for those that are damaged."""
        rows = self._rows(name, files, columns, where)
        self.report_damage()
        return rows

    def _rows(
        self, name: str, files: Sequence[DataFile], columns: Sequence[str] | None, where: pc.Expression | None = None
    ) -> pa.Table:
        """Rows of files, in threads of Arrow that know nothing of Python.

        A thread that releases something of Python while Python ends aborts the process.
        """
        own, schema = list(columns) if columns else None, TABLES[name].schema

        def downloaded(file: DataFile) -> pa.Table:
            source = self._whole(file)
            return None if source is None else pq.read_table(source, columns=own, filters=where, schema=schema)

        place = self.place_of(name)
        with ThreadPoolExecutor(_DOWNLOADS) as pool:
            if isinstance(place, Path):
                whole = [file for file, source in zip(files, pool.map(self._whole, files)) if source is not None]
                system = SubTreeFileSystem(str(place), LocalFileSystem())
                rows = _dataset(whole, schema, system).to_table(columns=own, filter=where)
            else:
                empty = schema.empty_table()
                parts = [part for part in pool.map(downloaded, files) if part is not None]
                rows = pa.concat_tables([empty.select(own) if own else empty, *parts])
        return rows

    def _whole(self, file: DataFile) -> pa.NativeFile | None:
        """A file whose bytes have the SHA-256 that is in its name."""
        place, known = self.place_of(file.table) / file.name, (file.table, file.name)
        try:
            if isinstance(place, Path):
                if known not in self._verified:
                    with place.open("rb") as content:
                        self._verify(file, hashlib.file_digest(content, "sha256").hexdigest())
                return pa.OSFile(str(place)) if known in self._verified else None
            data = read_bytes(place)
            self._verify(file, hashlib.sha256(data).hexdigest())
            return pa.BufferReader(data) if known in self._verified else None
        except (FileNotFoundError, LocationError) as error:
            if isinstance(error, LocationError) and error.code != "location.not-found":
                raise
            self._damaged[known] = "is missing"
            return None

    def _verify(self, file: DataFile, sha256: str) -> None:
        if sha256 == file.sha256:
            self._verified.add((file.table, file.name))
            self._damaged.pop((file.table, file.name), None)  # restored
        else:
            self._damaged[file.table, file.name] = "is damaged: its SHA-256 is not the one in its name"

    @property
    def damaged(self) -> list[str]:
        """Files that are left out because they are damaged or missing, as far as they were read."""
        return [f"{FOLDER}/{table}/{name}" for table, name in sorted(self._damaged)]

    def report_damage(self) -> None:
        """Name each file that was found damaged, once, by a `DamageWarning`."""
        for (table, name), fault in sorted(self._damaged.items()):
            if (table, name) not in self._warned:
                self._warned.add((table, name))
                again = (
                    f", or delete the directory {FOLDER}/{table}: it is written again" if TABLES[table].advisory else ""
                )
                rest = f"its rows are left out; restore it from a backup{again}"
                warnings.warn(
                    f"lake {self.url!r}: {FOLDER}/{table}/{name} {fault}; {rest}", DamageWarning, stacklevel=2
                )

    def exists(self, name: str) -> bool:
        """Whether there is a table, readable or not.

        Raises
        ------
        LocationError
            If the storage does not answer.
        """
        log = self.place_of(name) / _LOG
        return any(log.glob("*.json")) if isinstance(log, Path) else bool(find(f"{log.address}/*.json"))

    def snapshot(self, name: str) -> Snapshot:
        """What a table that was opened consists of at its newest version."""
        table = self._tables[name]
        version, found = self._snapshots.get(name, (-1, None))
        if found is None or version != table.version():
            version = table.version()
            found = Snapshot.read(name, table, read_bytes(self.place_of(name) / _LOG / f"{version:020}.json"))
            self._snapshots[name] = version, found
        return found

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
            self._damaged[name, _LOG] = f"is damaged: {error}"
            self.report_damage()
            return None
        return self._tables[name]

    def created(self, name: str) -> None:
        """Open the table at its newest version, which may be a new one."""
        if self.opened(name) is not None or (name, _LOG) in self._damaged:
            return
        one = TABLES[name]
        new = Snapshot(name, tuple(one.schema.names), {}, {})
        with suppress(CommitFailedError):  # another process has created it in the same moment
            DeltaTable.create(
                self._uri(name), one.schema, mode="ignore", partition_by=one.partitions,
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


def _dataset(files: Iterable[DataFile], schema: pa.Schema, system: FileSystem) -> ds.FileSystemDataset:
    parquet = ds.ParquetFileFormat()
    fragments = [parquet.make_fragment(one.name, system, partition_expression=_contents_of(one)) for one in files]
    return ds.FileSystemDataset(fragments, schema, parquet, system)


def _contents_of(file: DataFile) -> pc.Expression | None:
    """What its name says of all its rows."""
    if file.day is not None:
        return pc.field("day") == pa.scalar(file.day, pa.date32())
    if file.key is None:
        return None
    return (pc.field("content") == file.key.content) & (pc.field("recipe") == file.key.recipe)


def _rows_of(table: pa.Table, columns: Sequence[str]) -> list[Row]:
    return list(zip(*(table[name].to_pylist() for name in columns)))
