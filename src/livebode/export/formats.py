"""The formats by name, and a file that appears in its place when it is complete."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, TypeVar

from livebode.core import OutputError, whole_file, writing
from livebode.dataclass import dataclass
from livebode.plugins import named


@dataclass(frozen=True)
class Export:
    """A format; what it can contain is written by what is named as "module:name".

    Attributes
    ----------
    ending
        Of its files.
    responses
        Called with the path, an iterable of `Responses` and the run's summary.
    matrices
        The same with `MatrixResponses`.
    parameters
        Called with the path and a table of fitted parameters.
    model
        Called with the path and an `LpvModel`: the model over the position.

    Each returns a `WriteResult`.
    """

    ending: str
    responses: str = ""
    matrices: str = ""
    parameters: str = ""
    model: str = ""


def _own(function: str) -> str:
    return f"livebode.export.{function}"


EXPORTS: Mapping[str, Export] = {
    "csv": Export(
        ".csv",
        _own("delimited:write_csv"),
        _own("matrix_delimited:write_matrix_csv"),
        _own("parameters:write_parameters_csv"),
    ),
    "mat": Export(
        ".mat",
        _own("matlab:write_mat"),
        _own("matrix_matlab:write_matrix_mat"),
        _own("parameters:write_parameters_mat"),
        _own("lpv:write_lpv_mat"),
    ),
    "netcdf": Export(
        ".nc",
        _own("labelled:write_netcdf"),
        _own("matrix_labelled:write_matrix_netcdf"),
        model=_own("lpv:write_lpv_netcdf"),
    ),
    "uff": Export(".uff", _own("universal:write_uff"), _own("matrix_universal:write_matrix_uff")),
    "json": Export(".json", model=_own("lpv:write_lpv_json")),
    "c": Export(".h", model=_own("lpv:write_lpv_c")),
}
"""livebode's formats by name."""
Content = Literal["responses", "matrices", "parameters", "model"]


def writers(content: Content) -> Mapping[str, str]:
    """The formats that can contain this, by name, each with "module:name" of what writes it."""
    return {name: writer for name, export in named("exports").items() if (writer := getattr(export, content))}


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
    check_free(path, force=force)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as partial:
            written = write(partial)
            check_free(path, force=force)
    return written


def check_free(path: Path, *, force: bool) -> None:
    """OutputError if a file must not be written there: a directory, or a file that may not be replaced."""
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
