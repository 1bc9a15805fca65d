"""The Parquet file of a closed segment: it matches the manifest, or is damaged."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from livebode.core import RecordError
from livebode.records.inside import open_read
from livebode.records.segments.manifest import Segment
from livebode.tables import Footer, ParquetFile

_VALUES_MAX = 1 << 27  # 1 GiB of numbers; a full journal holds 32 MiB
_VERIFIED_MAX = 100_000
_verified: set[tuple[object, ...]] = set()


def open_segment(run: Path, segment: Segment) -> ParquetFile:
    """Read the file into memory. Its checksum is computed once per process, as long as the file is unchanged.

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
        content = ParquetFile(data)
    except ValueError as error:
        raise RecordError(
            "damaged", f"it is not Parquet ({error})", "restore it from a backup", path=str(run / segment.name)
        ) from None
    _check_size(content.footer, segment)
    return content


def _check_size(footer: Footer, segment: Segment) -> None:
    if footer.rows != segment.rows:
        raise RecordError(
            "damaged",
            f"it has {footer.rows} rows, but the manifest states {segment.rows}",
            "restore it from a backup",
            path=segment.name,
            rows=footer.rows,
        )
    size_bytes = sum(group.size_bytes for group in footer.groups)
    values = footer.rows * len(footer.columns)
    if max(values, size_bytes // 8) > _VALUES_MAX:
        raise RecordError(
            "too-large",
            f"its {footer.rows} rows are more than a segment can have",
            "move it away",
            path=segment.name,
            rows=footer.rows,
        )
