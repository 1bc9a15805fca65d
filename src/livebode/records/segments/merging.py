"""Merging: small segments become larger ones as a run ages, so that a year of them is opened as fast as a day.

16 consecutive segments become one, 16 of those again, and so on up to 4 MiB: a row is written a few times more at most,
and the number of files grows with the logarithm of the length until they have that size. Larger ones would make reading
an hour slower: the checksum is that of a whole file.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from livebode.records.inside import is_folder
from livebode.records.segments.manifest import SEGMENT_NAME, TABLES, Manifest, Segment, segment_numbers
from livebode.records.segments.segment_file import SegmentFile
from livebode.records.segments.segment_writer import GROUP_ROWS
from livebode.tables import Table

_MERGED_MAX = 4 << 20
_BUDGET_SHARE = 32  # the budget removes whole segments
_FAN_IN = 16


def merged_bytes_max(budget_bytes: int | None) -> int:
    """Largest size of a merged segment for a budget of the record."""
    return _MERGED_MAX if budget_bytes is None else min(_MERGED_MAX, max(0, budget_bytes) // _BUDGET_SHARE)


def groups_to_merge(segments: list[Segment], bytes_max: int) -> Iterator[list[Segment]]:
    """Groups of 16 consecutive segments of a table, of one level, that together have at most this size."""
    for table in TABLES:
        of_table = [segment for segment in segments if segment.table == table]
        begin = 0
        while len(group := of_table[begin : begin + _FAN_IN]) == _FAN_IN:
            levels = [_level(segment) for segment in group]
            if len(set(levels)) > 1:  # continue where the last level begins
                begin += max(i for i in range(1, _FAN_IN) if levels[i] != levels[i - 1])
                continue
            if sum(segment.size_bytes for segment in group) <= bytes_max:
                yield group
            begin += _FAN_IN


def rows_to_merge(run: Path, parts: list[Segment]) -> list[Table] | None:
    """The rows of each segment; None if one is missing or damaged, or has other columns."""
    tables = []
    for part in parts:
        try:
            with SegmentFile(run, part) as file:
                if not all(file.intact):
                    return None
                tables.append(Table.join([file.rows(group) for group in range(len(file.intact))]))
        except (FileNotFoundError, TypeError, ValueError):
            return None
        if tables[-1].schema != tables[0].schema:
            return None
    return tables


def row_groups(tables: list[Table]) -> Iterator[Table]:
    """The rows in few parts that end with the end of a table, and so with a whole response."""
    waiting: list[Table] = []
    for table in tables:
        waiting.append(table)
        if sum(rows.num_rows for rows in waiting) >= GROUP_ROWS:
            yield Table.join(waiting)
            waiting = []
    if waiting:
        yield Table.join(waiting)


def unlisted(run: Path, manifest: Manifest) -> list[str]:
    """Files that a kill left before their line was written, or after the line on their removal; none if lines of the
    manifest are damaged, which may have listed them.
    """
    if manifest.broken:
        return []
    listed = {segment.name for segment in manifest.segments}
    folders = [table for table in TABLES if is_folder(run / table)]
    names = [f"{table}/{path.name}" for table in folders for path in (run / table).iterdir()]
    names = [name for name in names if name not in listed and SEGMENT_NAME.fullmatch(name)]
    return [name for name in names if manifest.is_closed(segment_numbers(name)[1])]


def _level(segment: Segment) -> int:
    first, last = segment.numbers
    level, journals = 0, last - first + 1
    while journals >= _FAN_IN:
        level, journals = level + 1, journals // _FAN_IN
    return level
