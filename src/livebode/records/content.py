"""Content of a recording as one name: the same bytes have the same name under any path."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from livebode.core import RecordingError

_SAME_TIME_NS = 1_000_000_000
"""A file that changes twice within it may have the same time of change."""


def content_sha256(path: Path) -> str:
    """SHA-256 of a recording in hexadecimal digits: of a file that of its bytes, as `sha256sum` prints it.

    Of a directory, such as a ROS 2 bag, it is that of its files in the order of their names (`joined_sha256`). A file
    that has not changed is read once in a process.

    Raises
    ------
    RecordingError
        If there is no such file, or it cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_bytes(b"abc")
    ...     content_sha256(path)
    'ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad'
    """
    try:
        if path.is_dir():
            files = sorted(file for file in path.rglob("*") if file.is_file())
            return joined_sha256([content_sha256(file) for file in files])
        status = path.stat()
        if time.time_ns() - status.st_mtime_ns < _SAME_TIME_NS:
            return _digest(path)
        return _digest_once(path, status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
    except FileNotFoundError:
        raise RecordingError("not-found", f"there is no file {path}", "check the name", path=str(path)) from None
    except OSError as error:
        raise RecordingError(
            "not-readable",
            f"cannot read {path}: {error.strerror}",
            "check its permissions",
            path=str(path),
            errno=error.errno,
        ) from None


@lru_cache(64)
def _digest_once(path: Path, *_unchanged: int) -> str:
    """Computed once per process, as long as the file is unchanged."""
    return _digest(path)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def joined_sha256(parts: Sequence[str]) -> str:
    """One name for several contents in this order; that of a single one is its own.

    It is the SHA-256 of the names of the parts, each in a line.

    >>> joined_sha256(["ba7816bf"]), joined_sha256(["ba7816bf", "2d711642"])[:8]
    ('ba7816bf', 'ebfc2973')
    """
    if len(parts) == 1:
        return parts[0]
    return hashlib.sha256("".join(f"{part}\n" for part in parts).encode()).hexdigest()
