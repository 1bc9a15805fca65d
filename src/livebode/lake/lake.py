"""Lake: the tables below one URL, and the commits to them."""

from __future__ import annotations

import hashlib
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from pyarrow.fs import LocalFileSystem, SubTreeFileSystem

from livebode.core import ArchiveError
from livebode.core.files import whole_file
from livebode.core.installing import not_installed
from livebode.lake.data_file import JOINED, DataFile, Key, parquet_writer
from livebode.lake.schemas import TABLES
from livebode.locations import Location, Url, delta_options, location, read_bytes, write_whole
from livebode.locations.storage import make_parent, opened, reporting

try:
    from deltalake import CommitProperties, DeltaTable, Schema, Transaction
    from deltalake.exceptions import CommitFailedError, DeltaError, TableNotFoundError
    from deltalake.transaction import AddAction, RemoveAction
except ImportError:
    raise not_installed("deltalake is not installed, and a lake needs it", "deltalake", "archive") from None

Row = tuple[Any, ...]
_DOWNLOADS = 8


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
        self._place: Location = place.absolute() if isinstance(place, Path) else place
        self.url = str(place)
        self._tables: dict[str, DeltaTable] = {}
        self._known: dict[str, tuple[int, set[Row]]] = {}

    def read(self, name: str, columns: Sequence[str] | None = None, where: pc.Expression | None = None) -> pa.Table:
        """The rows of a table as they are now, in no order; none if nothing was written yet.

        Rows of results that are not complete are included; see `quantities`.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self.reported(name):
            table = self.opened(name)
            if table is None:
                empty = TABLES[name].schema.empty_table()
                return empty.select(columns) if columns else empty
            return self._rows(name, table, columns, where)

    def rows(self, name: str) -> ds.Dataset | pa.Table | None:
        """The rows of a table as they are now: on this computer not read yet; None if nothing was written.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        with self.reported(name):
            table = self.opened(name)
            if table is None:
                return None
            return self._rows(name, table, None) if isinstance(self._place, Url) else self._dataset(name, table)

    def rows_of(self, name: str, key: Key) -> pa.Table:
        """The rows of one result in a table of responses, parameters or events, read from as few files as possible.

        They are in the order in which they were tracked.

        Raises
        ------
        ArchiveError
            If the table cannot be read.
        """
        schema, place = TABLES[name].schema, self._place / name
        where = (pc.field("content") == key.content) & (pc.field("recipe") == key.recipe)
        with self.reported(name):
            table = self.opened(name)
            files = [] if table is None else [uri.rsplit("/", 1)[-1] for uri in table.file_uris()]
            own = f"{key.content}-{key.recipe}.parquet"
            parts = [schema.empty_table()]
            for file in [own] if own in files else [file for file in files if file.startswith(JOINED)]:
                source = pa.BufferReader(read_bytes(place / file)) if isinstance(place, Url) else place / file
                parts.append(pq.read_table(source, filters=where, schema=schema))
            return pa.concat_tables(parts).sort_by("sample")

    def quantities(self) -> pa.Table:
        """The quantities of the results that count, those with a row in `runs`."""
        found, counted = self.read("quantities"), self.keys("runs")
        keys = zip(found["content"].to_pylist(), found["recipe"].to_pylist())
        return found.filter(pa.array([key in counted for key in keys], pa.bool_()))

    def keys(self, name: str) -> set[Row]:
        """The keys of the rows of a table."""
        with self.reported(name):
            return self._keys(name, self.opened(name))

    def add_rows(self, name: str, rows: pa.Table) -> int:
        """Append the rows whose key is not in the table, and return their number."""
        with self.reported(name):
            while True:
                table = self.created(name)
                present, own = self._keys(name, table), _rows_of(rows, TABLES[name].key)
                new = rows.filter(pa.array([key not in present for key in own], pa.bool_()))
                if not new.num_rows:
                    return 0
                if self.commit(table, name, _added([self._group_file(name, new)])):
                    present.update(own)
                    self._known[name] = (table.version(), present)
                    return int(new.num_rows)

    def add_files(self, name: str, files: Sequence[DataFile]) -> None:
        """Add files that are in the table's directory already, except those of results that count already.

        Adding a file twice has no effect. A file whose rows were joined with others by `compact` belongs to a result
        in `runs`.
        """
        with self.reported(name):
            while files:
                table = self.created(name)
                counted = self.keys("runs")
                files = [file for file in files if file.rows and file.key not in counted]
                if not files or self.commit(table, name, _added(files)):
                    return

    def store(self, path: Path, table: str) -> None:
        """Put a file in the directory of a table, completely or not at all.

        Raises
        ------
        ArchiveError, LocationError
            If it cannot be written.
        """
        target = self._place / table / path.name
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

    def _group_file(self, name: str, rows: pa.Table) -> DataFile:
        schema, buffer = TABLES[name].schema, pa.BufferOutputStream()
        with parquet_writer(buffer, schema) as writer:
            writer.write_table(rows.cast(schema))
        data = buffer.getvalue().to_pybytes()
        file = DataFile(name, f"rows-{hashlib.sha256(data).hexdigest()}.parquet", len(data), rows.num_rows)
        write_whole(self._place / name / file.name, data)
        return file

    def commit(
        self,
        table: DeltaTable,
        name: str,
        actions: list[AddAction | RemoveAction],
        positions: Mapping[str, int] | None = None,
    ) -> bool:
        """Commit in the version after the one that was read; False if somebody else has written that one.

        The `positions` in streams are stored in the same commit.
        """
        before, one = table.version(), TABLES[name]
        transactions = [Transaction(stream, at) for stream, at in (positions or {}).items()]
        once = CommitProperties(max_commit_retries=0, app_transactions=transactions)
        try:
            table.create_write_transaction(
                actions, "append", one.schema, partition_by=one.partitions, commit_properties=once
            )
        except CommitFailedError:
            table.update_incremental()
            if table.version() == before:
                raise
            return False
        table.update_incremental()
        return True

    def _keys(self, name: str, table: DeltaTable | None) -> set[Row]:
        if table is None:
            return set()
        version, found = self._known.get(name, (-1, set()))
        if version != table.version():
            key = list(TABLES[name].key)
            found = set(_rows_of(self._rows(name, table, key), key))
            self._known[name] = (table.version(), found)
        return found

    def _rows(
        self, name: str, table: DeltaTable, columns: Sequence[str] | None, where: pc.Expression | None = None
    ) -> pa.Table:
        """Rows of a table, read without deltalake's file system.

        That one is written in Python: a thread of Arrow that closes a file while Python ends aborts the process.
        """
        place, schema = self._place / name, TABLES[name].schema
        if isinstance(place, Path):
            return self._dataset(name, table).to_table(columns=columns, filter=where)

        def part(uri: str) -> pa.Table:
            source = pa.BufferReader(read_bytes(place / uri.rsplit("/", 1)[-1]))
            return pq.read_table(source, columns=columns, filters=where, schema=schema)

        with ThreadPoolExecutor(_DOWNLOADS) as pool:
            empty = schema.empty_table()
            return pa.concat_tables([empty.select(columns) if columns else empty, *pool.map(part, table.file_uris())])

    def _dataset(self, name: str, table: DeltaTable) -> ds.Dataset:
        """Rows of a table on this computer."""
        own = SubTreeFileSystem(str(self._place / name), LocalFileSystem())
        # A table of an earlier livebode lacks the newest columns, which are then null.
        return table.to_pyarrow_dataset(filesystem=own, schema=TABLES[name].schema)

    def opened(self, name: str) -> DeltaTable | None:
        """The table at its newest version; None if it does not exist."""
        try:
            if name in self._tables:
                self._tables[name].update_incremental()
            else:
                self._tables[name] = self._table(name)
        except TableNotFoundError:
            return None
        return self._tables[name]

    def created(self, name: str) -> DeltaTable:
        """The table at its newest version, which may be a new one, with all columns."""
        if (table := self.opened(name)) is not None:
            return _with_all_columns(table, name)
        one = TABLES[name]
        with suppress(CommitFailedError):  # another process has created it in the same moment
            DeltaTable.create(
                self._uri(name), one.schema, mode="ignore", partition_by=one.partitions,
                storage_options=delta_options(self._place),
            )  # fmt: skip
        self._tables[name] = self._table(name)
        return self._tables[name]

    def _table(self, name: str) -> DeltaTable:
        return DeltaTable(self._uri(name), storage_options=delta_options(self._place))

    def _uri(self, name: str) -> str:
        place = self._place / name
        return str(place) if isinstance(place, Path) else place.address

    @contextmanager
    def reported(self, name: str) -> Iterator[None]:
        """Within, an error of a table is an ArchiveError that names it."""
        try:
            yield
        except (DeltaError, OSError, pa.ArrowInvalid) as error:  # the last one of a damaged file
            raise ArchiveError(
                "lake-unusable",
                f"the table {name} of the lake {self.url!r} cannot be used: {str(error).splitlines()[0]}",
                "check the address, the permissions and the credentials in the environment",
                lake=self.url,
                table=name,
                reason=str(error),
            ) from error


def _with_all_columns(table: DeltaTable, name: str) -> DeltaTable:
    """Add the columns that a table of an earlier livebode lacks: compaction would drop those of new files."""
    known = {field.name for field in table.schema().fields}
    if missing := [field for field in TABLES[name].schema if field.name not in known]:
        with suppress(CommitFailedError):  # another process has added them in the same moment
            table.alter.add_columns(Schema.from_arrow(pa.schema(missing)).fields)
        table.update_incremental()
    return table


def _rows_of(table: pa.Table, columns: Sequence[str]) -> list[Row]:
    return list(zip(*(table[name].to_pylist() for name in columns)))


def _added(files: Sequence[DataFile]) -> list[AddAction | RemoveAction]:
    now_ms = time.time_ns() // 1_000_000
    return [AddAction(file.name, file.size_bytes, {}, now_ms, True, file.statistics) for file in files]
