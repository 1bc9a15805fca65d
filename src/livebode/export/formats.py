"""The formats by name, and a file that appears in its place when it is complete."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from livebode.core import MatrixResponses, OutputError, Responses
from livebode.core.files import whole_file
from livebode.core.writing import writing
from livebode.export.delimited import write_csv
from livebode.export.labelled import write_netcdf
from livebode.export.matlab import write_mat
from livebode.export.matrix_delimited import write_matrix_csv
from livebode.export.matrix_labelled import write_matrix_netcdf
from livebode.export.matrix_matlab import write_matrix_mat
from livebode.export.matrix_universal import write_matrix_uff
from livebode.export.parameters import write_parameters_csv, write_parameters_mat
from livebode.export.result import WriteResult
from livebode.export.universal import write_uff
from livebode.tables import Table

FORMATS: Mapping[str, Callable[[Path, Iterable[Responses], Mapping[str, Any]], WriteResult]] = {
    "csv": write_csv,
    "mat": write_mat,
    "netcdf": write_netcdf,
    "uff": write_uff,
}
"""Functions that write responses, by the name of the format."""

MATRIX_FORMATS: Mapping[str, Callable[[Path, Iterable[MatrixResponses], Mapping[str, Any]], WriteResult]] = {
    "csv": write_matrix_csv,
    "mat": write_matrix_mat,
    "netcdf": write_matrix_netcdf,
    "uff": write_matrix_uff,
}
"""Functions that write matrices of responses, by the name of the format."""

TABLES: Mapping[str, Callable[[Path, Iterable[Table]], WriteResult]] = {
    "csv": write_parameters_csv,
    "mat": write_parameters_mat,
}
"""Functions that write parameters, by the name of the format."""

ENDINGS: Mapping[str, str] = {
    "csv": ".csv", "mat": ".mat", "netcdf": ".nc", "uff": ".uff", "json": ".json", "c": ".h",
}  # fmt: skip

Done = TypeVar("Done")


def save(path: Path, write: Callable[[Path], Done], *, force: bool = False) -> Done:
    """Let `write` create a file next to its place, and move it there when it is complete.

    Parameters
    ----------
    path
        Path of the file; missing parent directories are created.
    write
        Called with the path of an empty file beside `path` to write to; its name has another suffix.
    force
        Whether to replace an existing file.

    Raises
    ------
    OutputError
        If the path exists and must not be replaced or is not a file, or the disk reports an error. Nothing is written
        then, and an existing file is unchanged.
    """
    _check_free(path, force)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as partial:
            written = write(partial)
            _check_free(path, force)
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
