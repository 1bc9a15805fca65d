"""Values of the command line that are converted at once: Typer loads pydantic for them, and builds a model for each."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, get_args, get_origin

_WHOLE = re.compile(r"[+-]?[0-9]{1,15}")
_DECIMAL = re.compile(r"[+-]?[0-9]{1,15}([.][0-9]{1,15})?(e[+-]?[0-9]{1,2})?")


class LeftToTyperError(ValueError):
    """A value that Typer has to convert or to refuse."""


def plain_value(value: Any, annotation: Any, info: Any) -> Any:
    """What Typer makes of a value; LeftToTyperError if it is not text, a switch, a path or a number in the usual form.

    Parameters
    ----------
    value
        Text of the command line, a list of texts, or a default.
    annotation
        Type of the parameter.
    info
        Typer's description of it, with its limits.
    """
    if get_origin(annotation) is list and isinstance(value, list | tuple):
        (inner,) = get_args(annotation)
        return [plain_value(one, inner, info) for one in value]
    if info.parser is not None:
        return _parsed(value, info)
    if annotation is str and isinstance(value, str):
        return value
    if annotation is bool and isinstance(value, bool):
        return value
    if annotation is Path and isinstance(value, str | Path):
        return _path(Path(value), info)
    if annotation in (int, float) and type(value) in (str, annotation):
        return _number(value, annotation, info)
    raise LeftToTyperError


def _parsed(value: Any, info: Any) -> Any:
    try:
        return info.parser(value)
    except Exception as error:  # Typer meets it too, and words it
        raise LeftToTyperError from error


def _path(path: Path, info: Any) -> Path:
    checked = (info.exists, info.resolve_path, info.writable, info.allow_dash, info.path_type)
    if any(checked) or not (info.file_okay and info.dir_okay):
        raise LeftToTyperError
    if info.readable and not os.access(path, os.R_OK) and os.path.lexists(path):
        raise LeftToTyperError
    return path


def _number(value: Any, kind: type, info: Any) -> Any:
    if isinstance(value, str) and not (_WHOLE if kind is int else _DECIMAL).fullmatch(value):
        raise LeftToTyperError
    number = kind(value)
    if info.clamp or not (info.min is None or number >= info.min) or not (info.max is None or number <= info.max):
        raise LeftToTyperError
    return number
