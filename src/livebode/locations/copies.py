"""Local copies of files and runs at URLs: downloaded to a temporary directory, and removed afterwards."""

from __future__ import annotations

import errno
import logging
import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from livebode.core import LivebodeError, LocationError
from livebode.core.writing import why
from livebode.locations.storage import opened, reporting
from livebode.locations.url import Location, Url, location

_logger = logging.getLogger(__name__)
_RUN = "run.json"
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
_present: dict[str, str] = {}
"""The URL that each temporary directory stands for: of the directory that the copy is from."""


class LocalCopy:
    """A copy of the file at a URL, or with `run` of the run directory there, until it is closed or no longer in use.

    Attributes
    ----------
    url
        Where it is from.
    path
        Where the copy is; its name is that at the URL.

    Raises
    ------
    LocationError
        If it cannot be downloaded completely, or does not fit on the disk.
    ExtraError
        If a package for this storage is not installed.
    """

    def __init__(self, url: Url, *, run: bool = False) -> None:
        system, source = opened(url)
        self.url = url
        folder = tempfile.mkdtemp(prefix="livebode-")
        self._finalizer = weakref.finalize(self, _remove, folder)
        self.path = Path(folder) / (url.name or "run")
        _present[folder] = str(url).rpartition("/")[0]
        try:
            with reporting(url):
                (_download_run if run else _download)(url, system, source, self.path)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Remove the copy."""
        self._finalizer()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def local_copy(place: str | os.PathLike[str] | Url) -> Iterator[Path]:
    """The path of a file: a local one itself, of a URL a temporary copy with the same name.

    An error within names the URL in place of the copy. Errors as of `LocalCopy`.

    Examples
    --------
    >>> with local_copy("logs/a.csv") as path:
    ...     print(path)
    logs/a.csv
    """
    with _copied(location(place), run=False) as path:
        yield path


@contextmanager
def download(place: str | os.PathLike[str] | Url) -> Iterator[Path]:
    """The path of a run directory: a local one itself, of a URL a temporary copy; otherwise as `local_copy`."""
    with _copied(location(place), run=True) as path:
        yield path


def original(text: str) -> str:
    """A text with the URLs of local copies in place of their paths."""
    for folder, url in _present.items():
        text = text.replace(folder, url)
    return text


def with_originals(error: LivebodeError) -> LivebodeError:
    """The error, which names URLs in place of their local copies from now on."""
    if _present:
        error.message, error.remedy, error.place = map(original, (error.message, error.remedy, error.place))
        error.facts.update({name: original(value) for name, value in error.facts.items() if isinstance(value, str)})
    return error


@contextmanager
def _copied(place: Location, *, run: bool) -> Iterator[Path]:
    if isinstance(place, Path):
        yield place
        return
    with LocalCopy(place, run=run) as copy:
        try:
            yield copy.path
        except LivebodeError as error:
            raise with_originals(error) from error.__cause__


def _remove(folder: str) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    _present.pop(folder, None)


def _download(url: Url, system: Any, source: str, to: Path) -> None:
    """One file. Large ones arrive in concurrent parts, so its version must be the same before and after."""
    before = system.info(source)
    if before["type"] != "file":
        raise LocationError("not-found", f"{url} is not a file", "name a file below it", path=str(url))
    _get(url, system, source, to)
    size = before.get("size")
    if size is not None and to.stat().st_size != size:
        raise LocationError(
            "interrupted",
            f"{url} has {size} bytes, and {to.stat().st_size} arrived",
            "try again",
            path=str(url),
            size_bytes=size,
        )
    if version(system.info(source)) != version(before):
        raise LocationError("changed", f"{url} changed while it was downloaded", "try again", path=str(url))
    _logger.info("%s: downloaded, %d bytes", url, to.stat().st_size)


def _download_run(url: Url, system: Any, source: str, to: Path) -> None:
    """All files of a run; run.json is first, since a run that is incomplete or removed has none."""
    files = system.find(source)
    names = [file.removeprefix(source.rstrip("/")).lstrip("/") for file in files]
    if _RUN not in names:
        code = "not-a-run" if names else "not-found"
        raise LocationError(code, f"there is no run at {url}: it has no {_RUN}", "name a run directory", path=str(url))
    to.mkdir()
    for name, file in sorted(zip(names, files), key=lambda found: found[0] != _RUN):
        if ".." in name.split("/"):
            continue
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        _download(url / name, system, file, to / name)


def _get(url: Url, system: Any, source: str, to: Path) -> None:
    try:
        system.get_file(source, str(to))
    except OSError as error:
        if error.errno not in _DISK or isinstance(error, PermissionError | FileNotFoundError):
            raise
        raise LocationError(
            "no-space",
            f"{url} cannot be copied to {to.parent.parent}: {why(error)}",
            "free some space, or set TMPDIR to a directory with more",
            path=str(url),
            errno=error.errno,
        ) from None


def version(info: dict[str, Any]) -> str:
    """A text that changes with the content of a file at a URL: its ETag, or size and time."""
    etag = info.get("ETag") or info.get("etag")
    if etag:
        return str(etag).strip('"')
    moments = [info.get(name) for name in ("mtime", "LastModified", "last_modified", "created", "modified")]
    return "-".join(str(value) for value in (info.get("size"), *moments) if value is not None)
