"""Join the small files of a lake, and remove files that belong to no version of a table."""

from __future__ import annotations

from dataclasses import dataclass

from deltalake import ColumnProperties, DeltaTable, WriterProperties

from livebode.lake.data_file import JOINED
from livebode.lake.lake import Lake
from livebode.lake.schemas import TABLES
from livebode.records.wide_responses import wide_options

RETENTION_HOURS = 7 * 24


@dataclass(frozen=True)
class Compacted:
    """What compaction did to a table: its files before and after, and how many old ones were removed.

    `open_results` results have files and no row in `runs`: an archive is running, or was ended. The files of the table
    are then not joined.
    """

    table: str
    before: int
    after: int
    removed: int
    open_results: int = 0


def compact(lake: Lake) -> list[Compacted]:
    """Join small files of each table, and remove files older than a week that are not in it.

    A file in a table that was replaced, and a file that a process wrote before it was killed, remain for a week: a
    reader may use the first, and a running archive may still commit the second. `livebode fleet sink` joins its own.

    Raises
    ------
    ArchiveError
        If a table cannot be read or written.
    """
    return [found for name, one in TABLES.items() if not one.days and (found := _compacted(lake, name)) is not None]


def _compacted(lake: Lake, name: str) -> Compacted | None:
    with lake.reported(name):
        table = lake.opened(name)
        if table is None:
            return None
        before = len(table.file_uris())
        waiting = _open_results(lake, name, table)
        if not waiting:
            table.optimize.compact(writer_properties=_layout(name))
        removed = table.vacuum(RETENTION_HOURS, dry_run=False, full=True)
        return Compacted(name, before, len(table.file_uris()), len(removed), waiting)


def _open_results(lake: Lake, name: str, table: DeltaTable) -> int:
    """Results with a file of their own that do not count yet; such a file must keep its name to be added only once."""
    if TABLES[name].key:
        return 0
    counted = {f"{content}-{recipe}" for content, recipe in lake.keys("runs")}
    names = [uri.rpartition("/")[2].removesuffix(".parquet") for uri in table.file_uris()]
    return sum(not name.startswith(JOINED) and name not in counted for name in names)


def _layout(name: str) -> WriterProperties:
    """The layout of `parquet_writer`."""
    options = wide_options(TABLES[name].schema)
    columns = {
        path: ColumnProperties(dictionary_enabled=False, encoding=encoding)
        for path, encoding in options["column_encoding"].items()
    }
    return WriterProperties(
        compression="ZSTD", compression_level=options["compression_level"], column_properties=columns
    )
