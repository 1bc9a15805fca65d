"""File system operations: append bytes completely, and write files completely or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path

from livebode.core import LivebodeError
from livebode.records.inside import check_own

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_WORDS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.EIO: "the disk has an input/output error",
    errno.EFBIG: "the file has its largest size",
    errno.EROFS: "the disk is read-only",
}


def why(error: OSError | LivebodeError) -> str:
    """Description of a system error.

    >>> why(OSError(errno.ENOSPC, "No space left on device"))
    'the disk is full'
    """
    if not isinstance(error, OSError):
        return str(error)
    return _WORDS.get(error.errno or 0, error.strerror or str(error))


def put_whole(path: Path, data: bytes | memoryview) -> None:
    """Write a file: it has all of `data` or is unchanged, also after a power cut; OSError if it is not written."""
    partial = path.with_name(f".{path.name}.partial")
    with contextlib.suppress(FileNotFoundError):
        os.unlink(partial)  # a remainder of a kill; if it were a link, another file would be written
    try:
        file = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        try:
            _write_all(file, data)
            os.fsync(file)
        finally:
            os.close(file)
        os.replace(partial, path)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(partial)
        raise
    sync_directory(path.parent)


def sync_directory(path: Path) -> None:
    """Sync a directory, so that its names survive a power cut."""
    directory = os.open(path, os.O_RDONLY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)


class AppendFile:
    """A file that grows by complete pieces: a partly written piece is cut off before the next one.

    Parameters
    ----------
    run, name
        Its place in the directory of a run. Created if it is missing.
    length
        Length to which it is cut if it is longer; None: not cut.

    Raises
    ------
    RecordError
        If it is a link or not a regular file.
    """

    def __init__(self, run: Path, name: str, length: int | None = None) -> None:
        check_own(run, name)
        self._file = os.open(run / name, os.O_WRONLY | os.O_CREAT | os.O_APPEND | _NO_LINK, 0o644)
        size = os.fstat(self._file).st_size
        self.length = size if length is None else min(size, length)
        self._torn = size > self.length

    def append(self, data: bytes) -> None:
        """Write all of it, or raise OSError; a partly written piece counts as not written."""
        if self._torn:
            os.ftruncate(self._file, self.length)
        self._torn = True
        _write_all(self._file, data)
        self._torn = False
        self.length += len(data)

    def back_to(self, length: int) -> None:
        """Cut the file to this length."""
        self._torn = True
        self.length = length

    def sync(self) -> None:
        """Sync the file, so that its content survives a power cut; OSError if this is not certain."""
        getattr(os, "fdatasync", os.fsync)(self._file)  # not on macOS

    def append_synced(self, data: bytes) -> None:
        """Append and sync; after an OSError neither counts as done."""
        before = self.length
        try:
            self.append(data)
            self.sync()
        except OSError:
            self.back_to(before)
            raise

    def close(self) -> None:
        os.close(self._file)


def _write_all(file: int, data: bytes | memoryview) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(file, rest) :]
