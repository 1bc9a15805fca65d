"""Reading a record in segments, also while it is being written."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa

from livebode.records.segments import journal
from livebode.records.segments.journal import Journal
from livebode.records.segments.manifest import Manifest, Segment


def in_segments(run: Path) -> bool:
    """Whether this run is kept in segments."""
    return (run / journal.FOLDER).is_dir()


def parts(run: Path, table: str, *, finished: bool) -> tuple[list[Segment], list[pa.Table]]:
    """Closed segments of a table, by age, and the rows behind them that are still in a journal."""
    # The newest first: what is before a journal that is there is complete. And before the manifest: a journal that is
    # closed in between is then in both, and not in neither.
    journals = {number: _read(run, number) for number in reversed(journal.numbers(run))}
    found = Manifest.read(run)
    found.check(run, list(journals), finished=finished)
    rows = [
        pa.Table.from_batches(journals[number].rows[table])
        for number in sorted(journals)
        if number not in found.closed and table in journals[number].rows
    ]
    return [segment for segment in found.segments if segment.table == table], rows


def tables(
    run: Path, table: str, size_bytes_max: int | None, span_s: tuple[float, float] | None = None, *, finished: bool
) -> Iterator[pa.Table]:
    """The rows in order, part by part; with `size_bytes_max` only the newest that fit in it, with `span_s` without the
    segments outside of that time.

    Raises
    ------
    InputError
        If a segment is not what the manifest says, or the manifest is damaged.
    OSError
        If something cannot be read.
    """
    segments, rows = parts(run, table, finished=finished)
    if span_s is not None:
        segments = [segment for segment in segments if segment.first_s <= span_s[1] and segment.last_s >= span_s[0]]
    for segment in segments if size_bytes_max is None else _newest(segments, size_bytes_max):
        try:
            yield segment.read(run)
        except FileNotFoundError:
            if segment in Manifest.read(run).segments:
                raise
            # It was removed to keep the budget since we looked.
    yield from rows


def _newest(segments: list[Segment], size_bytes_max: int) -> list[Segment]:
    used, at = 0, len(segments)
    while at and (used := used + segments[at - 1].size_bytes) <= size_bytes_max:
        at -= 1
    return segments[at:]


def _read(run: Path, number: int) -> Journal:
    try:
        return Journal.read(journal.path_of(run, number))
    except FileNotFoundError:  # it was closed since we looked
        return Journal()
