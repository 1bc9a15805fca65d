"""Local copies of files and runs at URLs: downloaded to a temporary directory, and removed afterwards."""

from __future__ import annotations

import errno
import logging
import os
import tempfile
import threading
import weakref
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from livebode.core import LivebodeError, LocationError, remove_created, why
from livebode.locations.url import Url, location

_logger = logging.getLogger(__name__)
_DIRECTORIES = {"run.json": "a run", "metadata.yaml": "a ROS 2 bag"}
"""The file that each kind of directory has, downloaded first: without it the directory is not complete."""
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
_present: dict[str, str] = {}
"""The URL that each temporary directory stands for: of the directory that the copy is from."""
_shared: weakref.WeakValueDictionary[str, LocalCopy] = weakref.WeakValueDictionary()
_sharing = threading.Lock()


class LocalCopy:
    """A copy of a file, run or bag at a URL, which is removed when nothing refers to it.

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

    def __init__(self, url: Url) -> None:
        from livebode.locations.storage import opened, reporting

        system, source = opened(url)
        self.url = url
        self.path = temporary_place(url)
        self._finalizer = weakref.finalize(self, remove_temporary, self.path)
        try:
            with reporting(url):
                information = system.info(source)
                if information["type"] == "directory":
                    _download_directory(url, system, source, self.path)
                else:
                    _download(url, system, source, self.path, information)
        except BaseException:
            self._finalizer()
            raise


@contextmanager
def local_copy(place: str | os.PathLike[str] | Url) -> Iterator[Path]:
    """The path of a file or run: a local one itself, of a URL a temporary copy with the same name.

    Within, whatever opens the URL uses this copy, and an error names the URL in its place. Errors as of `LocalCopy`.

    Examples
    --------
    >>> with local_copy("logs/a.csv") as path:
    ...     print(path)
    logs/a.csv
    """
    path_or_url = location(place)
    if isinstance(path_or_url, Path):
        yield path_or_url
        return
    copy = shared_copy(path_or_url)
    try:
        yield copy.path
    except LivebodeError as error:
        raise with_originals(error) from error.__cause__
    finally:
        del copy  # a traceback would keep it


def shared_copy(url: Url) -> LocalCopy:
    """The copy that is in use for this URL, or a new one; it exists as long as anybody has it."""
    with _sharing:
        copy = _shared.get(url.address)
        if copy is None:
            copy = _shared[url.address] = LocalCopy(url)
        return copy


def original(text: str) -> str:
    """A text with the URLs of local copies in place of their paths."""
    for folder, url in list(_present.items()):  # other threads may have copies too
        text = text.replace(folder, url)
    return text


def is_copy(path: Path) -> bool:
    """Whether a path is that of a local copy, or within one."""
    return original(str(path)) != str(path)


def with_originals(error: LivebodeError) -> LivebodeError:
    """The error, which names URLs in place of their local copies from now on."""
    if _present:
        error.message, error.remedy, error.place = map(original, (error.message, error.remedy, error.place))
        error.facts.update({name: original(value) for name, value in error.facts.items() if isinstance(value, str)})
    return error


def temporary_place(url: Url) -> Path:
    """A path with the name of the URL in a new temporary directory; `original` finds the URL from it."""
    folder = tempfile.mkdtemp(prefix="livebode-")
    _present[folder] = str(url).rstrip("/").rpartition("/")[0]
    return Path(folder) / (url.name or "copy")


def remove_temporary(path: Path) -> None:
    """Remove what is there, and the directory that it is in."""
    remove_created(path.parent)
    _present.pop(str(path.parent), None)


def _download(url: Url, system: Any, source: str, to: Path, before: dict[str, Any]) -> None:
    """One file. A connection that ends may be resumed, so its version must be the same before and after."""
    _get(url, system, source, to)
    size_bytes, arrived_bytes = before.get("size"), to.stat().st_size
    if size_bytes is not None and arrived_bytes != size_bytes:
        raise LocationError(
            "interrupted",
            f"{url} has {size_bytes} bytes, and {arrived_bytes} arrived",
            "try again",
            path=str(url),
            size_bytes=size_bytes,
        )
    if version(system.info(source)) != version(before):
        raise LocationError("changed", f"{url} changed while it was downloaded", "try again", path=str(url))
    if written_s := _moments_s(before)[:1]:
        os.utime(to, (written_s[0], written_s[0]))  # a report states when a run was written
    _logger.info("%s: downloaded, %d bytes", url, arrived_bytes)


def _download_directory(url: Url, system: Any, source: str, to: Path) -> None:
    files = {name.removeprefix(source.rstrip("/")).lstrip("/"): info for name, info in _files(system, source)}
    if not files.keys() & _DIRECTORIES.keys():
        kinds = " or ".join(f"{kind} ({name})" for name, kind in _DIRECTORIES.items())
        raise LocationError("not-a-run", f"{url} is not {kinds}", "name a run directory or a file", path=str(url))
    to.mkdir()
    for name, info in sorted(files.items(), key=lambda item: item[0] not in _DIRECTORIES):
        if ".." not in name.split("/"):
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            _download(url / name, system, info["name"], to / name, info)


def _files(system: Any, source: str) -> Iterable[tuple[str, dict[str, Any]]]:
    return system.find(source, detail=True).items()  # type: ignore[no-any-return]


def _get(url: Url, system: Any, source: str, to: Path) -> None:
    from livebode.locations.storage import in_pieces

    try:
        system.get_file(source, str(to), **in_pieces(url))
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
    return "-".join(map(str, (info.get("size"), *_moments_s(info))))


def _moments_s(info: dict[str, Any]) -> list[float]:
    """When it was written, as the storage names it: a datetime or a number, of some one in a listing and one alone."""
    values = [info.get(name) for name in ("mtime", "LastModified", "last_modified", "modified", "created")]
    moments = [value.timestamp() if isinstance(value, datetime) else value for value in values]
    return [moment for moment in moments if isinstance(moment, int | float)]
