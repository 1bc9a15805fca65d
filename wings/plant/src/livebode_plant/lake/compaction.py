"""Join the small files of a lake, and remove files that belong to no version of a table."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pyarrow as pa

from livebode.core import ArchiveError, DamageWarning
from livebode.dataclass import dataclass
from livebode_plant.lake.data_file import JOINED, DataFile, DataFileWriter, small_files
from livebode_plant.lake.lake import Lake
from livebode_plant.lake.schemas import TABLES

RETENTION_HOURS = 7 * 24


@dataclass(frozen=True)
class CompactionResult:
    """What compaction did to a table: its files before and after, and how many old ones were removed.

    `open_results` results have files and no row in `runs`: an archive is running, or was ended. The files of the table
    are then not joined.
    """

    table: str
    before: int
    after: int
    removed: int
    open_results: int = 0


def compact(lake: Lake) -> list[CompactionResult]:
    """Join small files of each table, and remove files older than a week that are not in it.

    A file in a table that was replaced, and a file that a process wrote before it was killed, remain for a week: a
    reader may use the first, and a running archive may still commit the second. `livebode fleet sink` joins its own.
    A damaged file is not joined, and a table with a damaged log remains as it is; a `DamageWarning` names them.

    Raises
    ------
    ArchiveError
        If a table cannot be read or written, or its directory has files that livebode did not write.
    """
    lake.check()
    results = []
    for name in [name for name, table in TABLES.items() if not table.days]:
        try:
            results.append(_compacted(lake, name))
        except ArchiveError as error:
            if error.code != "archive.lake-damaged":
                raise
            warnings.warn(str(error), DamageWarning, stacklevel=2)
    return [table for table in results if table is not None]


def _compacted(lake: Lake, name: str) -> CompactionResult | None:
    def joined(parts: Iterator[pa.Table]) -> list[DataFile]:
        with TemporaryDirectory(prefix="livebode-") as folder, DataFileWriter(Path(folder), name, JOINED) as writer:
            for part in parts:
                writer.write(part)
            file = writer.finish()
            lake.store(file, writer.content)
            return [file]

    with lake.reported(name):
        if lake.opened(name) is None:
            return None
        files = lake.files(name)
        waiting = _open_results(lake, name, files)
        if not waiting:
            for group in small_files(files):
                lake.join(name, group, joined)
        removed = lake.remove_unused(name, RETENTION_HOURS)
        return CompactionResult(name, len(files), len(lake.files(name)), removed, waiting)


def _open_results(lake: Lake, name: str, files: list[DataFile]) -> int:
    """Results with a file of their own that do not count yet; such a file must keep its name to be added only once."""
    if TABLES[name].key:
        return 0
    counted = lake.keys("runs")
    return sum(file.key is not None and file.key not in counted for file in files)
