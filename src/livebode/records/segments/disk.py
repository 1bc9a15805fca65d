"""AppendFile: a file that grows by complete pieces."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.core import write_all
from livebode.records.inside import check_own

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)


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
        self._file = os.open(run / name, os.O_WRONLY | os.O_CREAT | os.O_APPEND | _NO_LINK, 0o666)
        size = os.fstat(self._file).st_size
        self.length = size if length is None else min(size, length)
        self._torn = size > self.length

    def append(self, data: bytes) -> None:
        """Write all of it, or raise OSError; a partly written piece counts as not written."""
        if self._torn:
            os.ftruncate(self._file, self.length)
        self._torn = True
        write_all(self._file, data)
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
