"""Small files at a path or URL, read and written whole."""

from __future__ import annotations

import os
import secrets
from pathlib import Path

from livebode.core import LocationError, files, remove_created, writing
from livebode.locations.storage import make_parent, opened, reporting
from livebode.locations.url import Url, location


def read_bytes(place: str | os.PathLike[str] | Url) -> bytes:
    """The content of a file at a path or URL.

    Raises
    ------
    LocationError
        If it cannot be read, for any reason; code "location.not-found" if it is not there.
    ExtraError
        If a package for this storage is not installed.
    """
    path_or_url = location(place)
    if isinstance(path_or_url, Path):
        with reporting(Url(str(path_or_url))):
            return path_or_url.read_bytes()
    system, path = opened(path_or_url)
    with reporting(path_or_url):
        return bytes(system.cat_file(path))


def write_whole(place: str | os.PathLike[str] | Url, data: bytes, *, new: bool = False) -> None:
    """Write a file to a path or URL; missing directories are created.

    At a path and in S3 and similar storages, the file is complete or not there at all; in others, such as SFTP, the
    beginning of a file may remain.

    Parameters
    ----------
    place
        Where.
    data
        Its content.
    new
        Refuse if there is a file already. Of two processes that write a new file at the same time, one succeeds; S3
        does this with a conditional put, and some other storages only check first.

    Raises
    ------
    LocationError
        If it cannot be written to the URL; code "location.exists" if it is there already, also for a path.
    OutputError
        If it cannot be written to the path.
    ExtraError
        If a package for this storage is not installed.
    """
    path_or_url = location(place)
    if isinstance(path_or_url, Path):
        _write_here(path_or_url, data, new)
        return
    system, path = opened(path_or_url)
    with reporting(path_or_url):
        make_parent(path_or_url, system, path)
        system.pipe_file(path, data, mode="create" if new else "overwrite")


def _write_here(path: Path, data: bytes, new: bool) -> None:
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if not new:
            files.write_whole(path, data)
            return
        # A link is created only where there is nothing, and its file is complete before.
        complete = path.with_name(f".{path.name[:50]}.new-{secrets.token_hex(4)}")
        files.write_whole(complete, data)
        try:
            os.link(complete, path)
        except FileExistsError:
            raise LocationError("exists", f"{path} exists already", "choose another path", path=str(path)) from None
        finally:
            remove_created(complete)
