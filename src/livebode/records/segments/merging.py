"""Merging: small segments become larger ones as a run ages, so that a year of them is opened as fast as a day.

32 consecutive segments become one, 32 of those again, and so on up to 16 MiB: each row is written at most three times
more, and the number of files grows with the logarithm of the length until they have that size.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa

from livebode.core import RecordError
from livebode.records.inside import is_folder
from livebode.records.segments.manifest import TABLES, Manifest, Segment
from livebode.records.segments.segment_file import open_segment

_MERGED_MAX = 16 << 20
_BUDGET_SHARE = 32  # the budget removes whole segments
_FAN_IN = 32
_MERGED = re.compile(r"\d{6,9}-\d{6,9}\.parquet")


def merged_bytes_max(budget_bytes: int | None) -> int:
    """Largest size of a merged segment for a budget of the record."""
    return _MERGED_MAX if budget_bytes is None else min(_MERGED_MAX, max(0, budget_bytes) // _BUDGET_SHARE)


def groups_to_merge(segments: list[Segment], bytes_max: int) -> Iterator[list[Segment]]:
    """Groups of 32 consecutive segments of a table, of one level, that together have at most this size."""
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


def rows_to_merge(run: Path, parts: list[Segment]) -> pa.Table | None:
    """The rows of these segments; None if one is missing, damaged, or of an earlier version with other columns."""
    tables = []
    for part in parts:
        try:
            tables.append(open_segment(run, part).read(use_threads=False))
        except (RecordError, FileNotFoundError):
            return None
        if tables[-1].schema != tables[0].schema:
            return None
    return pa.concat_tables(tables)


def unlisted(run: Path, found: Manifest) -> list[str]:
    """Merged segments that a kill left before their line was written."""
    listed = {segment.name for segment in found.segments}
    names = [
        f"{table}/{path.name}"
        for table in TABLES
        if is_folder(run / table)
        for path in (run / table).iterdir()
        if _MERGED.fullmatch(path.name)
    ]
    return [name for name in names if name not in listed]


def _level(segment: Segment) -> int:
    first, last = segment.numbers
    level, journals = 0, last - first + 1
    while journals >= _FAN_IN:
        level, journals = level + 1, journals // _FAN_IN
    return level
