"""The Parquet file of a segment: each row group matches the manifest, or is damaged."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import BinaryIO, Self

from livebode.core import RecordError
from livebode.records.inside import open_read
from livebode.records.segments.manifest import Segment
from livebode.tables import Footer, ParquetFile, Table

_VALUES_MAX = 1 << 27  # 1 GiB of numbers; a full journal holds 32 MiB
_VERIFIED_MAX = 100_000
_BLOCK = 1 << 20
_verified: dict[tuple[object, ...], tuple[bool, ...]] = {}


class SegmentFile:
    """The open file of a segment. Its checksums are computed once per process, as long as the file is unchanged.

    Use it as a context manager.

    Attributes
    ----------
    file
        The file.
    intact
        Whether the checksum of each row group is that of the manifest.

    Raises
    ------
    RecordError
        If its end does not match the manifest, so that no row group is found, or one has more than a segment can have.
    OSError
        If it cannot be read.
    """

    def __init__(self, run: Path, segment: Segment) -> None:
        self.file: BinaryIO = open_read(run, segment.name)
        try:
            *self.intact, end = _intact_parts(self.file, run, segment)
            if not end:
                raise _damaged(run, segment, "its checksum differs from the manifest")
            self._parquet = _parquet(self.file, run, segment)
            _check_size(self._parquet.footer, segment)
        except BaseException:
            self.file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def rows(self, group: int) -> Table:
        """The rows of a row group; errors as of `ParquetFile.table`."""
        return self._parquet.table([group])

    def extremes(self, group: int, column: str) -> tuple[float | None, float | None]:
        """The smallest and the largest value of a column in a row group; None: not known."""
        statistics = self._parquet.footer.statistics(group, column)
        return statistics.minimum, statistics.maximum


def _intact_parts(file: BinaryIO, run: Path, segment: Segment) -> tuple[bool, ...]:
    status = os.fstat(file.fileno())
    if status.st_size != segment.size_bytes:
        raise _damaged(run, segment, f"it has {status.st_size} bytes, but the manifest states {segment.size_bytes}")
    key = (segment.parts, status.st_dev, status.st_ino, status.st_mtime_ns)
    if key not in _verified:
        if len(_verified) >= _VERIFIED_MAX:
            _verified.clear()
        _verified[key] = tuple(_sha256_of_next(file, part.size_bytes) == part.sha256 for part in segment.parts)
    return _verified[key]


def _sha256_of_next(file: BinaryIO, size_bytes: int) -> str:
    digest = hashlib.sha256()
    while size_bytes > 0 and (block := file.read(min(size_bytes, _BLOCK))):
        digest.update(block)
        size_bytes -= len(block)
    return digest.hexdigest()


def _parquet(file: BinaryIO, run: Path, segment: Segment) -> ParquetFile:
    try:
        return ParquetFile(file)
    except ValueError as error:
        raise _damaged(run, segment, f"it is not Parquet ({error})") from None


def _check_size(footer: Footer, segment: Segment) -> None:
    if [group.rows for group in footer.groups] != [part.rows for part in segment.parts[:-1]]:
        raise RecordError(
            "damaged",
            f"it has {footer.rows} rows, but the manifest states {segment.rows}",
            "restore it from a backup",
            path=segment.name,
            rows=footer.rows,
        )
    for group in footer.groups:
        if max(group.rows * len(footer.columns), group.size_bytes // 8) > _VALUES_MAX:
            raise RecordError(
                "too-large",
                f"its {group.rows} rows are more than a segment can have",
                "move it away",
                path=segment.name,
                rows=group.rows,
            )


def _damaged(run: Path, segment: Segment, reason: str) -> RecordError:
    return RecordError("damaged", reason, "restore it from a backup", path=str(run / segment.name))
