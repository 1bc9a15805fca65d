"""A finished run directory to a URL."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Self

from livebode.core import LivebodeError, LocationError
from livebode.locations.copies import remove_temporary, temporary_place
from livebode.locations.objects import write_whole
from livebode.locations.storage import check_bucket, in_pieces, make_parent, opened, reporting
from livebode.locations.url import Url

_RUN = "run.json"


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
                    system.put_file(str(file), f"{root}/{name}", **in_pieces(url))
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


class Upload:
    """A run that is written on this computer for a URL, in a temporary directory; use it as a context manager.

    The directory is removed at the end, unless a run in it could not be uploaded.

    Parameters
    ----------
    url
        Where the run is to be.

    Attributes
    ----------
    path
        The directory to write, which does not exist yet; several runs may be written in directories within it.

    Raises
    ------
    LocationError
        If there is something at the URL, or the storage cannot be used: before the run, not after it.
    """

    def __init__(self, url: Url) -> None:
        self._url = url
        system, path = opened(url)
        with reporting(url):
            check_bucket(url, system, path)
            taken = system.exists(path)
        if taken:
            raise LocationError(
                "exists",
                f"there is something at {url} already, and it is not replaced",
                "choose another URL, or remove it with the tools of the storage",
                path=str(url),
            )
        self.path = temporary_place(url)

    def send(self) -> None:
        """Upload each run that was written; errors as of `upload`."""
        for run in sorted(path.parent for path in self.path.rglob(_RUN)):
            upload(run, self._url if run == self.path else self._url / run.relative_to(self.path).as_posix())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if not (isinstance(error, LocationError) and error.code == "location.not-uploaded"):
            remove_temporary(self.path)
