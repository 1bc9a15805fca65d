"""Files of a run: only regular files, by plain name inside its directory, not through links.

A run is untrusted data. A link, a pipe or a device in it could refer to something outside.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from livebode.core import RecordError

_SAFE = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
_SAFE |= getattr(os, "O_BINARY", 0)


def open_read(run: Path, name: str) -> BinaryIO:
    """Open a file of a run for reading.

    Raises
    ------
    RecordError
        If it is not a regular file, or reached through a link.
    OSError
        If it cannot be opened; FileNotFoundError if it is missing.
    """
    check_folder(run, name)
    try:
        file = os.open(run / name, os.O_RDONLY | _SAFE)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.ENXIO):  # a link; a socket
            raise _not_regular(run / name) from None
        raise
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise _not_regular(run / name)
    return os.fdopen(file, "rb")


def read_bytes(run: Path, name: str, size_bytes_max: int | None = None) -> bytes:
    """Content of a file of a run; RecordError if it is longer than this."""
    with open_read(run, name) as file:
        small = size_bytes_max is None or os.fstat(file.fileno()).st_size <= size_bytes_max
        data = file.read(-1 if size_bytes_max is None else size_bytes_max + 1) if small else b""
    if not small or (size_bytes_max is not None and len(data) > size_bytes_max):
        raise RecordError(
            "too-large",
            f"{str(run / name)!r} is longer than {size_bytes_max} bytes, the limit for a file of a run",
            "move it away",
            path=str(run / name),
            limit_bytes=size_bytes_max,
        )
    return data


def is_folder(path: Path) -> bool:
    """Whether this is a directory, and not a link to one."""
    return path.is_dir() and not path.is_symlink()


def check_folder(run: Path, name: str) -> None:
    """RecordError if the directory of a run's file is a link, or a file."""
    folder = (run / name).parent
    if folder != run and os.path.lexists(folder) and not is_folder(folder):
        raise RecordError(
            "not-own-file",
            f"{str(folder)!r} is a link or a file instead of a directory",
            "remove it",
            path=str(folder),
        )


def check_own(run: Path, name: str) -> None:
    """RecordError if a file to be written is a link, not a regular file, or has another hard link."""
    check_folder(run, name)
    try:
        status = os.lstat(run / name)
    except FileNotFoundError:
        return
    if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
        raise _not_regular(run / name)


def _not_regular(path: Path) -> RecordError:
    return RecordError(
        "not-own-file", f"{str(path)!r} is not a regular file (a link, a pipe or a device)", "remove it", path=str(path)
    )
