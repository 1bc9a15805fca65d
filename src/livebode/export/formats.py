"""The formats by name, and a file that appears in its place when it is complete."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import pyarrow as pa

from livebode.core import OutputError, Responses
from livebode.export.delimited import write_csv
from livebode.export.labelled import write_netcdf
from livebode.export.matlab import write_mat
from livebode.export.parameters import write_parameters_csv, write_parameters_mat
from livebode.export.result import WriteResult
from livebode.export.universal import write_uff

FORMATS: Mapping[str, Callable[[Path, Iterable[Responses], Mapping[str, Any]], WriteResult]] = {
    "csv": write_csv,
    "mat": write_mat,
    "netcdf": write_netcdf,
    "uff": write_uff,
}
"""Functions that write responses, by the name of the format."""

TABLES: Mapping[str, Callable[[Path, Iterable[pa.RecordBatch]], WriteResult]] = {
    "csv": write_parameters_csv,
    "mat": write_parameters_mat,
}
"""Functions that write parameters, by the name of the format."""

ENDINGS: Mapping[str, str] = {"csv": ".csv", "mat": ".mat", "netcdf": ".nc", "uff": ".uff"}

Done = TypeVar("Done")
_DISK = {errno.ENOSPC: "the disk is full", errno.EDQUOT: "the disk quota is used up"}


def save(path: Path, write: Callable[[Path], Done], *, force: bool = False) -> Done:
    """Let `write` create a file next to its place, and move it there when it is complete.

    Parameters
    ----------
    path
        Path of the file; missing parent directories are created.
    write
        Called with the path to write to, which has the name of `path`.
    force
        Whether to replace an existing file.

    Raises
    ------
    OutputError
        If the path exists and must not be replaced or is not a file, or the disk reports an error. Nothing is written
        then, and an existing file is unchanged.
    """
    _check_free(path, force)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=f".{path.name[:100]}.partial-", dir=path.parent) as folder:
            partial = Path(folder) / path.name
            written = write(partial)
            _check_free(path, force)
            partial.replace(path)
    except OSError as error:
        why = _DISK.get(error.errno or 0, os.strerror(error.errno) if error.errno else str(error))
        raise OutputError(
            "not-written",
            f"{str(path)!r} could not be written: {why}; nothing was changed there",
            "free some space, or choose another path",
            path=str(path),
            reason=why,
            errno=error.errno,
        ) from None
    return written


def _check_free(path: Path, force: bool) -> None:
    if path.is_dir():
        raise OutputError("is-directory", f"{str(path)!r} is a directory", "choose the path of a file", path=str(path))
    if not force and (path.exists() or path.is_symlink()):
        raise OutputError(
            "exists",
            f"{str(path)!r} exists already",
            "choose another path, or replace it with force",
            path=str(path),
            argument="force",
        )
