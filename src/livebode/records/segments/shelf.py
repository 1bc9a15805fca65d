"""The closed segments of a run: journals become Parquet, and the oldest segments are removed above the budget."""

from __future__ import annotations

import contextlib
import errno
import io
import logging
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from livebode.core import remove_files, sync_directory, write_whole
from livebode.records.column_table import ColumnTable
from livebode.records.inside import is_folder
from livebode.records.segments import journal, manifest
from livebode.records.segments.disk import AppendFile
from livebode.records.segments.manifest import Manifest, Retained, Segment
from livebode.records.segments.merging import groups_to_merge, row_groups, rows_to_merge, unlisted
from livebode.records.segments.segment_writer import SegmentWriter
from livebode.tables import Table

FIRST_TO_GO = "samples"
_LONG_BYTES, _SHORTER = 128 << 10, 3
_PLACES_MAX = 512
Tiers = Callable[[Mapping[str, Table]], Mapping[str, Table]]
_logger = logging.getLogger(__name__)


def no_tiers(_: Mapping[str, Table]) -> Mapping[str, Table]:
    return {}


class Shelf:
    """Closes journals and applies the budget.

    The manifest is authoritative: a segment is written before its line, a journal is removed after it, and a segment is
    removed after the line on its removal. A kill between two steps leaves only files without an entry.

    Parameters
    ----------
    run
        Directory of the run.
    tables
        Its tables by name.
    found
        Its manifest.
    sealed
        Numbers of journals that are complete and not closed yet.
    tiers
        The tables of means of the rows of a journal.
    """

    def __init__(
        self, run: Path, tables: Mapping[str, ColumnTable], listed: Manifest, sealed: list[int], tiers: Tiers = no_tiers
    ) -> None:
        self._run, self._tables, self._tiers = run, tables, tiers
        self._file = AppendFile(run, manifest.NAME, listed.length)
        self._segments = list(listed.segments)
        self._retained = list(listed.retained)
        self._closed, self._sound = listed.last_closed, not listed.broken
        places = [(listed.place(name), name) for name in listed.merged]
        self._places = [(place[0].name, name, place[1]) for place, name in places if place is not None]
        self._sealed = list(sealed)
        self._unwanted: list[str] = []

    def begin(self) -> None:
        """Begin the manifest of a new run."""
        self._file.append_synced(manifest.first_line())

    @property
    def manifest_bytes(self) -> int:
        """Length of the manifest."""
        return self._file.length

    @property
    def used_bytes(self) -> int:
        """The recorded segments and retained damaged journals of the manifest."""
        sizes = [each.size_bytes for each in self._segments] + [each.size_bytes for each in self._retained]
        return self._file.length + sum(sizes)

    @property
    def retained(self) -> list[Retained]:
        """Journals that were damaged when they were closed."""
        return list(self._retained)

    @property
    def sealed(self) -> list[int]:
        """Numbers of the journals that are not closed yet."""
        return list(self._sealed)

    def seal(self, number: int) -> None:
        """This journal is complete; another one continues."""
        self._sealed.append(number)

    def close_journals(self) -> None:
        """Convert the sealed journals to segments; after an OSError the others are unchanged."""
        self.discard()
        while self._sealed:
            self._turn(self._sealed[0])
            del self._sealed[0]

    def make_room(self, bytes_max: int) -> list[Segment]:
        """Remove the oldest segments until at most this is used.

        First those of samples, then all others equally, and last the means of old responses, which are small.
        """
        gone: list[Segment] = []
        excess = self.used_bytes - bytes_max
        order = sorted(
            self._segments, key=lambda segment: (segment.table != FIRST_TO_GO) + (segment.table in manifest.TIERS)
        )
        for segment in order:
            if excess <= 0:
                break
            gone.append(segment)
            excess -= segment.size_bytes
        if gone:
            self._file.append_synced(manifest.removal_line(gone))
            self._segments = [segment for segment in self._segments if segment not in gone]
            self.discard(*(segment.name for segment in gone))
        return gone

    def merge(self, bytes_max: int) -> None:
        """Merge one group of small consecutive segments into one of at most `bytes_max`, if there is such a group.

        Each closed journal adds a segment and each merge removes 15, so that one for each is enough, and short.

        The same steps as elsewhere: the new file, its line, and only then the removal of the old files. A group with a
        damaged file remains as it is.

        Raises
        ------
        OSError
            If the disk fails; the segments are then as before, or merged.
        """
        for parts in groups_to_merge(self._segments, bytes_max):
            if (rows := rows_to_merge(self._run, parts)) is not None:
                self._replace(parts, rows)
                return

    def shorten(self) -> None:
        """Write a long manifest again without the lines on segments that were merged or removed since.

        What a reader needs that listed segments before they were merged remains, for the newest 512.

        Raises
        ------
        OSError
            If the disk fails; the manifest is then unchanged.
        """
        if self._file.length < _LONG_BYTES or not self._sound:
            return
        present = {segment.name for segment in self._segments}
        self._places = [place for place in self._places[-_PLACES_MAX:] if place[0] in present]
        line = manifest.short_line(self._closed, self._segments, self._retained, self._places)
        data = manifest.first_line() + line
        if self._file.length < _SHORTER * len(data):
            return
        write_whole(self._run / manifest.NAME, data, locked=True)
        before, self._file = self._file, AppendFile(self._run, manifest.NAME)
        before.close()

    def _replace(self, parts: list[Segment], rows: list[Table]) -> None:
        name = manifest.name_of(parts[0].table, parts[0].numbers[0], parts[-1].numbers[1])
        segment = self._put(name, parts[0].table, *row_groups(rows))
        self._file.append_synced(manifest.merge_line(parts, segment))
        self._segments[self._segments.index(parts[0])] = segment
        self._segments = [listed for listed in self._segments if listed not in parts]
        before = 0
        for part in parts:
            self._places = [
                (segment.name, name, rows + before) if new == part.name else (new, name, rows)
                for new, name, rows in self._places
            ]
            self._places.append((segment.name, part.name, before))
            before += part.rows
        _logger.info("%s: %d segments merged into %s", self._run, len(parts), segment.name)
        self.discard(*(part.name for part in parts))

    def discard(self, *names: str) -> None:
        """Remove files without an entry; those that cannot be removed now are tried again next time."""
        self._unwanted = [name for name in (*self._unwanted, *names) if not _removed(self._run, name)]

    def close(self) -> None:
        """Close the manifest."""
        self._file.close()

    def _turn(self, number: int) -> None:
        read = journal.read_sealed(self._run, number)
        tables = {table: Table.join(batches) for table, batches in read.rows.items()}
        tables |= self._tiers(tables)
        segments = [
            self._put(manifest.name_of(table, number, number), table, rows) for table, rows in tables.items()
        ]  # fmt: skip
        retained = Retained.of_journal(self._run, number, read)
        self._file.append_synced(manifest.closing_line(number, segments, retained))
        self._segments += segments
        self._closed = max(self._closed, number)
        size_bytes = sum(segment.size_bytes for segment in segments)
        _logger.info("%s: journal %d closed: %d segments, %d bytes", self._run, number, len(segments), size_bytes)
        if retained is None:
            self.discard(journal.name_of(number))
        else:
            self._retained.append(retained)
            with contextlib.suppress(OSError):  # it is then done when the run is continued
                journal.set_aside(self._run, number)

    def _put(self, name: str, table: str, *groups: Table) -> Segment:
        folder = self._run / table
        if not is_folder(folder):
            os.mkdir(folder)
            sync_directory(self._run)
        sink = io.BytesIO()
        repeating = self._tables["responses" if table in manifest.TIERS else table].repeating
        writer = SegmentWriter(sink, groups[0].schema, repeating)
        for group in groups:
            writer.write(group)
        segment = writer.close(name, table)
        data = sink.getvalue()  # a view of it would be reported as an error where a failed write remains in a cycle
        write_whole(self._run / name, data, locked=True)
        return segment


def sweep(run: Path, listed: Manifest) -> None:
    """Remove what a kill left between two steps: segments with a line on their removal or merging, merged ones without
    a line, and closed journals.

    Other remainders of a kill are written again with the same name.
    """
    for segment in listed.gone:
        _removed(run, segment.name)
    for name in unlisted(run, listed):
        _removed(run, name)
    retained = {each.number for each in listed.retained}
    for number in journal.numbers(run):
        if number in retained:
            journal.set_aside(run, number)
        elif listed.is_closed(number):
            _removed(run, journal.name_of(number))


def _removed(run: Path, name: str) -> bool:
    try:
        remove_files((run / name).parent, [Path(name).name])
    except OSError as error:
        return error.errno == errno.ENOENT
    return True
