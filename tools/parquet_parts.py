"""The manifest of a run for Parquet files in a directory, from their own metadata."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from livebode.records.segments import manifest
from livebode.records.segments.manifest import Segment, SegmentPart


def manifest_of(folder: Path) -> bytes:
    """The lines on its tables, each of which is one segment."""
    segments = [segment_of(path) for path in sorted(folder.glob("*.parquet"))]
    return manifest.first_line() + manifest.closing_line(1, segments, None)


def segment_of(path: Path) -> Segment:
    """The segment of a whole run in this file: what `SegmentWriter` notes while it writes."""
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    samples, times_s = (table[name].to_pylist() if name in table.column_names else [] for name in ("sample", "time_s"))
    return Segment(
        name=path.name,
        table=path.stem,
        first_sample=min(samples, default=0),
        last_sample=max(samples, default=0),
        first_s=min(times_s, default=0.0),
        last_s=max(times_s, default=0.0),
        parts=parts_of(path),
    )


def parts_of(path: Path) -> tuple[SegmentPart, ...]:
    """The row groups and the end of the file, with their checksums."""
    import pyarrow.parquet as pq

    about, content = pq.read_metadata(path), path.read_bytes()
    groups = [about.row_group(number) for number in range(about.num_row_groups)]
    ends = [max(_end(group.column(k)) for k in range(group.num_columns)) for group in groups]
    rows = [group.num_rows for group in groups]
    return tuple(
        SegmentPart(number, end - begin, hashlib.sha256(content[begin:end]).hexdigest())
        for number, begin, end in zip([*rows, 0], [0, *ends], [*ends, len(content)])
    )


def _end(column: Any) -> int:
    begin = column.data_page_offset
    if column.has_dictionary_page:
        begin = min(begin, column.dictionary_page_offset)
    return int(begin + column.total_compressed_size)
