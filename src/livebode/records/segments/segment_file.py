"""The Parquet file of a closed segment: it matches the manifest, or is damaged."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from livebode.core import RecordError
from livebode.records.inside import open_read
from livebode.records.segments.manifest import Segment

_VALUES_MAX = 1 << 27  # 1 GiB of numbers; a full journal holds 32 MiB
_VERIFIED_MAX = 100_000
_verified: set[tuple[object, ...]] = set()


def open_segment(run: Path, segment: Segment) -> pq.ParquetFile:
    """Read the file, as `segment_content`."""
    return pq.ParquetFile(pa.BufferReader(segment_content(run, segment)))


def segment_content(run: Path, segment: Segment) -> bytes:
    """Content of the file. Its checksum is computed once per process, as long as the file is unchanged.

    Raises
    ------
    RecordError
        If it does not match the manifest, or contains more than a segment can.
    OSError
        If it cannot be read.
    """
    with open_read(run, segment.name) as file:
        status = os.fstat(file.fileno())
        if status.st_size != segment.size_bytes:
            raise RecordError(
                "damaged",
                f"it has {status.st_size} bytes, but the manifest states {segment.size_bytes}",
                "restore it from a backup",
                path=str(run / segment.name),
                size_bytes=status.st_size,
            )
        data = file.read(segment.size_bytes)
    key = (segment.sha256, status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
    if key not in _verified:
        if len(data) != segment.size_bytes or hashlib.sha256(data).hexdigest() != segment.sha256:
            raise RecordError(
                "damaged",
                "its checksum differs from the manifest",
                "restore it from a backup",
                path=str(run / segment.name),
            )
        if len(_verified) >= _VERIFIED_MAX:
            _verified.clear()
        _verified.add(key)
    try:
        about = pq.read_metadata(pa.BufferReader(data))
    except pa.ArrowException as error:
        raise RecordError(
            "damaged", f"it is not Parquet ({error})", "restore it from a backup", path=str(run / segment.name)
        ) from None
    _check_size(about, segment)
    return data


def _check_size(about: pq.FileMetaData, segment: Segment) -> None:
    if about.num_rows != segment.rows:
        raise RecordError(
            "damaged",
            f"it has {about.num_rows} rows, but the manifest states {segment.rows}",
            "restore it from a backup",
            path=segment.name,
            rows=about.num_rows,
        )
    size_bytes = sum(about.row_group(group).total_byte_size for group in range(about.num_row_groups))
    if max(about.num_rows * about.num_columns, size_bytes // 8) > _VALUES_MAX:
        raise RecordError(
            "too-large",
            f"its {about.num_rows} rows are more than a segment can have",
            "move it away",
            path=segment.name,
            rows=about.num_rows,
        )
