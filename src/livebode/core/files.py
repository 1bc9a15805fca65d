"""Files that are complete in their place or not there at all, also after a power cut.

What is written goes to a file or directory beside its place, is synced, and is moved there. Any exception removes it
and leaves the previous content unchanged. Only if the very last step fails, the sync of the new name, the new content
is already in place. Permissions are those of a usual `open` or `mkdir`.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from livebode.core.removal import remove_created, remove_files

_NAME_MAX = 50  # letters of the name, so that the partial's name is valid where the name is


@contextmanager
def whole_file(path: Path, *, locked: bool = False) -> Iterator[Path]:
    """A path to write a file to, which is moved to `path` when the block ends.

    A link at `path` is replaced, not followed; a file keeps its permissions; anything else remains and is refused.

    Parameters
    ----------
    path
        Its place, in an existing directory.
    locked
        Whether a lock excludes other processes; the partial's name is then the same each time, so that the remainder
        of a kill is replaced.

    Raises
    ------
    OSError
        If it cannot be written. Nothing has changed then.
    """
    with _created(path, locked) as (partial, _):
        yield partial


def write_whole(path: Path, data: bytes | memoryview, *, locked: bool = False) -> None:
    """Write a file with this content; see `whole_file`."""
    with _created(path, locked) as (_, file):
        write_all(file, data)


@contextmanager
def whole_files(folder: Path, name: str, *, locked: bool = False) -> Iterator[Path]:
    """A directory to write files to, which are moved to `folder` when the block ends; see `whole_file`.

    Parameters
    ----------
    folder
        An existing directory.
    name
        What they are, for the name of the directory: one word.
    locked
        As of `whole_file`, but the remainder of a kill has to be removed before.
    """
    partial = _partial(folder / name, locked)
    os.mkdir(partial)
    try:
        yield partial
        files = sorted(partial.iterdir())
        for file in files:
            _sync_file(file)
        for file in files:
            _move(file, folder / file.name)
        sync_directory(folder)
    finally:
        remove_created(partial)


@contextmanager
def whole_directory(path: Path, remove: Callable[[Path], None]) -> Iterator[Path]:
    """A directory to write to, which is moved to `path` when the block ends.

    Parameters
    ----------
    path
        Its place; missing parents are created.
    remove
        Removes the previous directory, after it was moved aside. What it refuses to remove remains there.

    Raises
    ------
    OSError
        If it cannot be written. Nothing has changed then.
    """
    path = path.absolute()  # "." has no parent in which a sibling can be created
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = _partial(path, locked=False)
    os.mkdir(partial)
    try:
        yield partial
        for inner in (*partial.rglob("*"), partial):
            (sync_directory if inner.is_dir() else _sync_file)(inner)
        _exchange(partial, path, remove)
    finally:
        remove_created(partial)


def move_directory(path: Path, folder: Path) -> Path:
    """Move a directory into another one of the same file system, synced; return its new place; OSError if refused."""
    to = folder / path.name
    path.rename(to)
    for changed in (folder, path.parent):
        sync_directory(changed)
    return to


def replace_file(path: Path, to: Path) -> None:
    """Move a file to the place of another file or link, which is removed; OSError if something else is there."""
    with contextlib.suppress(FileNotFoundError):
        mode = os.lstat(to).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
            raise FileExistsError(errno.EEXIST, "it is a directory, a pipe, a socket or a device", str(to))
    os.replace(path, to)


def write_all(file: int, data: bytes | memoryview) -> None:
    """Write all bytes to a descriptor; a part may be written where OSError is raised."""
    remainder = memoryview(data)
    while remainder:
        remainder = remainder[os.write(file, remainder) :]


def sync_directory(path: Path) -> None:
    """Sync a directory, so that its names survive a power cut."""
    if not hasattr(os, "O_DIRECTORY"):  # Windows opens no directory
        return
    directory = os.open(path, os.O_RDONLY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)


@contextmanager
def _created(path: Path, locked: bool) -> Iterator[tuple[Path, int]]:
    """The partial file, empty, and its descriptor."""
    partial = _partial(path, locked)
    if locked:
        remove_files(path.parent.resolve(), [partial.name])
    file = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        try:
            yield partial, file
            os.fsync(file)
        finally:
            os.close(file)
        _move(partial, path)
    except BaseException:
        remove_created(partial)
        raise
    sync_directory(path.parent)


def _partial(path: Path, locked: bool) -> Path:
    return path.with_name(f".{path.name[:_NAME_MAX]}.partial" + ("" if locked else f"-{os.urandom(4).hex()}"))


def _move(partial: Path, path: Path) -> None:
    with contextlib.suppress(FileNotFoundError):
        mode = os.lstat(path).st_mode
        if stat.S_ISREG(mode):
            os.chmod(partial, stat.S_IMODE(mode))
    replace_file(partial, path)


def _exchange(partial: Path, path: Path, remove: Callable[[Path], None]) -> None:
    """Put it in its place; the previous directory is removed, or remains if this fails."""
    old = path.with_name(f"{partial.name}.old")
    before = path.exists()
    if before:
        path.rename(old)
    try:
        partial.rename(path)
    except OSError:
        if before:
            old.rename(path)
        raise
    if before:
        with contextlib.suppress(OSError):
            remove(old)
    sync_directory(path.parent)


def _sync_file(path: Path) -> None:
    file = os.open(path, os.O_RDWR)  # some systems sync only what can be written
    try:
        os.fsync(file)
    finally:
        os.close(file)
