"""A finished run directory to a URL."""

from __future__ import annotations

import os
from pathlib import Path

from livebode.core import LivebodeError, LocationError
from livebode.locations.objects import write_whole
from livebode.locations.storage import make_parent, opened, reporting
from livebode.locations.url import Url

_RUN = "run.json"


def check_free(url: Url) -> None:
    """LocationError if there is anything at the URL, or it cannot be asked."""
    system, path = opened(url)
    with reporting(url):
        taken = system.exists(path)
    if taken:
        raise LocationError(
            "exists",
            f"there is something at {url} already, and it is not replaced",
            "choose another URL, or remove it with the tools of the storage",
            path=str(url),
        )


def upload(directory: str | os.PathLike[str], url: Url) -> None:
    """Copy a finished run directory to a URL.

    run.json is last and is written only where there is none: a run that was uploaded in part is not a run, and of two
    uploads to one URL only one completes.

    Raises
    ------
    LocationError
        If it cannot be uploaded completely, or a run is at the URL. The local directory is unchanged.
    """
    directory = Path(directory)
    if not (directory / _RUN).is_file():
        raise LocationError(
            "not-a-run", f"{str(directory)!r} has no {_RUN}", "name a finished run", path=str(directory)
        )
    system, root = opened(url)
    try:
        with reporting(url):
            if system.exists(f"{root}/{_RUN}"):
                raise FileExistsError
            for file in sorted(path for path in directory.rglob("*") if path.is_file()):
                if (name := file.relative_to(directory).as_posix()) != _RUN:
                    make_parent(url, system, f"{root}/{name}")
                    system.put_file(str(file), f"{root}/{name}")
        write_whole(url / _RUN, (directory / _RUN).read_bytes(), new=True)
    except LivebodeError as error:
        raise LocationError(
            "not-uploaded",
            f"the run could not be uploaded: {error.message}",
            f"{error.remedy}; the run is in {str(directory)!r}",
            path=str(url),
            directory=str(directory),
            reason=error.code,
        ) from error
