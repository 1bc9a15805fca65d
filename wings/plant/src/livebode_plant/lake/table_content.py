"""TableContent: the rows in files of tables, each file verified by the SHA-256 in its name."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from pyarrow.fs import FileSystem, LocalFileSystem, PyFileSystem, SubTreeFileSystem

from livebode.core import DamageWarning, LocationError
from livebode.locations import Location, location, read_bytes
from livebode.records import VerifiedFiles
from livebode_plant.lake.data_file import DataFile
from livebode_plant.lake.schemas import TABLES

FOLDER = "tables"
"""Directory of the tables in that of the lake, where a user may have other files too."""
LOG = "_delta_log"
_DOWNLOADS = 8


class TableContent:
    """Reads files of the tables below a URL. A damaged or missing file is left out, and reported once.

    Parameters
    ----------
    url
        Of the lake.
    """

    def __init__(self, url: str) -> None:
        place = location(url)
        self._place: Location = (place.absolute() if isinstance(place, Path) else place) / FOLDER
        self.url = str(place)
        self._verified: set[tuple[str, str]] = set()
        self._damaged: dict[tuple[str, str], str] = {}
        self._warned: set[tuple[str, str]] = set()

    def place_of(self, name: str) -> Location:
        """The directory of a table."""
        return self._place / name

    @property
    def damaged(self) -> list[str]:
        """Files that are left out because they are damaged or missing, as far as they were read."""
        return [f"{FOLDER}/{table}/{name}" for table, name in sorted(self._damaged)]

    def damage(self, table: str, file: str = LOG) -> str:
        """What is wrong with a file, or with the log of a table; empty if nothing is known."""
        return self._damaged.get((table, file), "")

    def set_damage(self, table: str, file: str, fault: str) -> None:
        """Remember what is wrong with a file; without a `fault` it is whole, for example because it was restored."""
        if fault:
            self._damaged[table, file] = fault
        else:
            self._verified.add((table, file))
            self._damaged.pop((table, file), None)

    def report_damage(self) -> None:
        """Name each file that was found damaged, once, by a `DamageWarning`."""
        for (table, name), fault in sorted(self._damaged.items()):
            if (table, name) not in self._warned:
                self._warned.add((table, name))
                again = (
                    f", or delete the directory {FOLDER}/{table}: it is written again" if TABLES[table].advisory else ""
                )
                remedy = f"its rows are left out; restore it from a backup{again}"
                warnings.warn(
                    f"lake {self.url!r}: {FOLDER}/{table}/{name} {fault}; {remedy}", DamageWarning, stacklevel=2
                )

    def dataset(self, name: str, files: Iterable[DataFile]) -> ds.Dataset:
        """The rows of files of a table, not read yet; each is verified when it is read."""
        by_name, schema = {file.name: file for file in files}, TABLES[name].schema
        system = PyFileSystem(VerifiedFiles(schema, lambda path: self._whole(by_name[path])))
        return _dataset(by_name.values(), schema, system)

    def rows(
        self,
        name: str,
        files: Sequence[DataFile],
        columns: Sequence[str] | None = None,
        where: pc.Expression | None = None,
    ) -> pa.Table:
        """Rows of files of a table, in threads of Arrow that know nothing of Python.

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
                return _dataset(whole, schema, system).to_table(columns=own, filter=where)
            empty = schema.empty_table()
            parts = [part for part in pool.map(downloaded, files) if part is not None]
            return pa.concat_tables([empty.select(own) if own else empty, *parts])

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
            self.set_damage(*known, "is missing")
            return None

    def _verify(self, file: DataFile, sha256: str) -> None:
        same = sha256 == file.sha256
        self.set_damage(file.table, file.name, "" if same else "is damaged: its SHA-256 is not the one in its name")


def _dataset(files: Iterable[DataFile], schema: pa.Schema, system: FileSystem) -> ds.FileSystemDataset:
    parquet = ds.ParquetFileFormat()
    fragments = [parquet.make_fragment(file.name, system, partition_expression=_contents_of(file)) for file in files]
    return ds.FileSystemDataset(fragments, schema, parquet, system)


def _contents_of(file: DataFile) -> pc.Expression | None:
    """What its name says of all its rows."""
    if file.day is not None:
        return pc.field("day") == pa.scalar(file.day, pa.date32())
    if file.key is None:
        return None
    return (pc.field("content") == file.key.content) & (pc.field("recipe") == file.key.recipe)
