"""Find files by a pattern, on this computer or at a URL."""

from __future__ import annotations

import glob
import os
from contextlib import suppress
from pathlib import Path

from livebode.dataclass import dataclass
from livebode.locations.copies import version
from livebode.locations.storage import check_bucket, opened, reporting
from livebode.locations.url import Location, Url, location

_MAGIC = "*?["


@dataclass(frozen=True)
class FoundFile:
    """A file that a pattern names.

    Attributes
    ----------
    url
        Where it is: a path, or a `Url`, which as a text has no secret.
    size_bytes
        Its length; None if the storage does not know it.
    version
        A text that changes when the content changes: the ETag of an object, or size and time of a file. A web server
        that reports neither ETag nor time gives the size only.
    """

    url: Location
    size_bytes: int | None
    version: str


def find(pattern: str | os.PathLike[str] | Url) -> list[FoundFile]:
    """The files that a path, a URL or a pattern with ``*``, ``?``, ``[…]`` and ``**`` names, sorted; possibly none.

    Parameters
    ----------
    pattern
        Such as ``"logs/**/*.csv"`` or ``"s3://bucket/site/**/*.csv"``; a directory names all files below it.

    Raises
    ------
    LocationError
        If the storage cannot be used, or there is no such bucket.
    ExtraError
        If a package for this storage is not installed.
    """
    place = location(pattern)
    return _below(place) if isinstance(place, Url) else _on_this_computer(place.expanduser())


def _on_this_computer(place: Path) -> list[FoundFile]:
    if place.is_dir():
        paths = [path for path in place.rglob("*") if path.is_file()]
    elif place.exists():
        paths = [place]
    else:
        paths = [path for name in glob.glob(str(place), recursive=True) if (path := Path(name)).is_file()]
    files = []
    for path in sorted(paths):
        with suppress(FileNotFoundError):  # removed meanwhile
            status = path.stat()
            files.append(FoundFile(path, status.st_size, f"{status.st_size}-{status.st_mtime_ns}"))
    return files


def _below(url: Url) -> list[FoundFile]:
    system, path = opened(url)
    with reporting(url):
        if any(letter in path for letter in _MAGIC):
            files = system.glob(path, detail=True)
            if not files:
                check_bucket(url, system, path)
        else:
            files = system.find(path, detail=True) or {path: system.info(path)}
    # What a storage calls a path lacks the scheme, and for some the host.
    prefix = url.address.rstrip("/").removesuffix(path)
    ordered = sorted((name, info) for name, info in files.items() if info["type"] == "file")
    return [FoundFile(Url(prefix + name), info.get("size"), version(info)) for name, info in ordered]
