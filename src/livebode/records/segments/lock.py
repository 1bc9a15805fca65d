"""Lock: only one process at a time records in a directory."""

from __future__ import annotations

import contextlib
import os
from importlib import import_module
from pathlib import Path

from livebode.core import RecordError, remove_files

try:
    import fcntl
except ImportError:  # Windows
    _POSIX = False
else:
    _POSIX = True


class Lock:
    """Locks a directory until it is released or the process ends in any way.

    POSIX locks the directory itself. Windows opens no directory: there a file beside it is locked, which the system
    unlocks when the process ends, and `release` removes.

    Raises
    ------
    RecordError
        If another process has locked it.
    """

    def __init__(self, directory: Path) -> None:
        self._beside = None if _POSIX else _beside(directory.absolute())
        self._file = os.open(directory, os.O_RDONLY) if self._beside is None else _created(self._beside)
        try:
            _lock(self._file)
        except BlockingIOError:
            os.close(self._file)
            raise RecordError(
                "locked",
                f"another process records in {str(directory)!r}",
                "stop it first, or choose another path",
                path=str(directory),
            ) from None

    def release(self) -> None:
        os.close(self._file)
        if self._beside is not None:
            with contextlib.suppress(OSError):  # another process has opened it
                remove_files(self._beside.parent.resolve(), [self._beside.name])


def _beside(directory: Path) -> Path:
    return directory.with_name(f".{directory.name}.lock")


def _created(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)


def _lock(file: int) -> None:
    """Lock an open file or directory; BlockingIOError if another process has locked it."""
    if _POSIX:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    msvcrt = import_module("msvcrt")
    try:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        raise BlockingIOError(error.errno, error.strerror) from None
