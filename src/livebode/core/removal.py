"""Removal of files: no other module removes anything (`tests/meta/test_removal_contract.py` verifies it).

Removed is a plain file that livebode wrote, by its name, in a directory that belongs to livebode. The caller verifies
the directory (run.json of a run, design.json of a design, log of a table) and knows the names in it. This module
ensures that the directory is not a link, that the name has no path in it, and that it is a regular file: neither a
link, nor a directory, a pipe, a socket or a device. Anything else remains, and is refused.

What this process has created itself under a random name, such as a temporary directory, is removed as a whole.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path


def remove_files(directory: Path, names: Iterable[str]) -> int:
    """Remove files of a directory, and return their number; names without a file are ignored.

    Parameters
    ----------
    directory
        A directory of livebode; not a link.
    names
        Names of files that livebode wrote there.

    Raises
    ------
    OSError
        If the directory is a link, or a name is not that of a regular file; those before it are removed.
    """
    removed = 0
    with _opened(directory) as (begin, file):
        for name in names:
            if name in ("", ".", "..") or os.path.basename(name) != name:
                raise OSError(errno.EINVAL, "not the name of a file, so it is not removed", name)
            with contextlib.suppress(FileNotFoundError):
                status = os.stat(begin / name, dir_fd=file, follow_symlinks=False)
                if not stat.S_ISREG(status.st_mode):
                    raise OSError(errno.EINVAL, f"{name!r} is not a regular file, so it is not removed", name)
                os.unlink(begin / name, dir_fd=file)
                removed += 1
    return removed


def remove_empty(directory: Path) -> None:
    """Remove an empty directory; OSError if it is a link, or contains anything."""
    os.rmdir(directory)


def remove_created(path: Path) -> None:
    """Remove what this process created under a random name: a file, or a directory with all that is in it.

    Links are removed and not followed. What cannot be removed remains.
    """
    with contextlib.suppress(OSError):
        if stat.S_ISDIR(os.lstat(path).st_mode):
            shutil.rmtree(path, ignore_errors=True)
        else:
            os.unlink(path)


@contextmanager
def _opened(directory: Path) -> Iterator[tuple[Path, int | None]]:
    """What names are appended to, and the descriptor of the directory: it cannot be exchanged for a link meanwhile."""
    if not hasattr(os, "O_DIRECTORY"):  # Windows opens no directory
        if not stat.S_ISDIR(os.lstat(directory).st_mode):
            raise NotADirectoryError(errno.ENOTDIR, "Not a directory", str(directory))
        yield directory, None
        return
    file = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        yield Path(), file
    finally:
        os.close(file)
