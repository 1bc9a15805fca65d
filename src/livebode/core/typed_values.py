"""What a type accepts, where that is plain: values of a `TypedTable` that need no library to be checked."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from livebode.dataclass import dataclass

REQUIRED = object()
"""The default of a key that has none."""
_WHOLE_MAX = 1 << 53
_NO_LIMITS = {"strict", "allow_inf_nan", "json_schema_extra"}
"""What a specification says that a value in its own type fulfils, or that is about documents only."""
_LIMITS: dict[str, Callable[[Any, Any], bool]] = {
    "gt": lambda value, limit: value > limit,
    "ge": lambda value, limit: value >= limit,
    "lt": lambda value, limit: value < limit,
    "le": lambda value, limit: value <= limit,
    "min_length": lambda value, limit: len(value) >= limit,
    "max_length": lambda value, limit: len(value) <= limit,
    "pattern": lambda value, limit: re.fullmatch(limit, value) is not None,
}


class NotPlainError(ValueError):
    """A value that is wrong, or about which pydantic has to decide."""


def _for_pydantic(given: Any, source: Any, handler: Any) -> Any:
    """How a model of pydantic, as plug-ins have, understands what a type of ours says."""
    from livebode.core.typed_table_model import annotated

    return handler.generate_schema(annotated(source, given))


class Specification:
    """Default and alias of a key, or limits in a type, as of pydantic's `Field`."""

    __get_pydantic_core_schema__ = _for_pydantic

    def __init__(self, *, default: Any = REQUIRED, alias: str | None = None, **limits: Any) -> None:
        self.default, self.alias, self.limits = default, alias, limits


@dataclass(frozen=True)
class ValueCheck:
    """A function that checks and may change a value of the type before it, as of pydantic's `AfterValidator`."""

    function: Callable[[Any], Any]
    __get_pydantic_core_schema__ = _for_pydantic


@dataclass(frozen=True)
class Conversion:
    """A function that makes a value from anything, as of pydantic's `PlainValidator`; `format` of its text."""

    function: Callable[[Any], Any]
    format: str
    __get_pydantic_core_schema__ = _for_pydantic


def plain_value(kind: Any, value: Any, lax: bool = False) -> Any:
    """The value as of this type; NotPlainError unless it is plainly one.

    Parameters
    ----------
    kind
        The type, also with `Annotated`.
    value
        Plain data.
    lax
        Whether text is accepted as a path, and a list as a tuple.
    """
    origin = get_origin(kind)
    if (check := _TYPES.get(kind) if origin is None else _FORMS.get(origin)) is not None:
        return check(kind, value, lax)
    if hasattr(kind, "of_plain"):
        return value if isinstance(value, kind) else kind.of_plain(value)
    raise NotPlainError


def _same(kind: Any, value: Any, lax: bool) -> Any:  # noqa: ARG001
    if type(value) is kind:
        return value
    raise NotPlainError


def _path(kind: Any, value: Any, lax: bool) -> Any:  # noqa: ARG001
    if isinstance(value, Path) or (lax and type(value) is str):
        return Path(value)
    raise NotPlainError


def _number(kind: Any, value: Any, lax: bool) -> Any:  # noqa: ARG001
    if type(value) is float and isfinite(value):
        return value
    if type(value) is int and abs(value) < _WHOLE_MAX:
        return float(value)
    raise NotPlainError


def _annotated(kind: Any, value: Any, lax: bool) -> Any:
    base, specified = get_args(kind)[0], kind.__metadata__
    if isinstance(specified[-1], Conversion):
        return _by(specified[-1].function, value)
    lax = lax or any(isinstance(each, Specification) and each.limits.get("strict") is False for each in specified)
    value = plain_value(base, value, lax)
    for each in specified:
        if isinstance(each, ValueCheck):
            value = _by(each.function, value)
        elif not isinstance(each, Specification) or not _fulfils(value, each.limits):
            raise NotPlainError
    return value


def _by(function: Callable[[Any], Any], value: Any) -> Any:
    try:
        return function(value)
    except Exception as error:  # whatever it is, pydantic meets it too, and raises or words it
        raise NotPlainError from error


def _fulfils(value: Any, limits: Mapping[str, Any]) -> bool:
    own = {name: limit for name, limit in limits.items() if name not in _NO_LIMITS}
    return own.keys() <= _LIMITS.keys() and all(_LIMITS[name](value, limit) for name, limit in own.items())


def _one_of_several(kind: Any, value: Any, lax: bool) -> Any:
    if value is None and NoneType in get_args(kind):
        return None
    found = []
    for each in get_args(kind):
        try:
            found.append(plain_value(each, value, lax))
        except NotPlainError:
            continue
    if len(found) != 1:  # pydantic chooses among several
        raise NotPlainError
    return found[0]


def _choice(kind: Any, value: Any, lax: bool) -> Any:  # noqa: ARG001
    for each in get_args(kind):
        if type(value) is type(each) and value == each:
            return each
    raise NotPlainError


def _list(kind: Any, value: Any, lax: bool) -> Any:
    if type(value) is not list:
        raise NotPlainError
    (inner,) = get_args(kind)
    return [plain_value(inner, each, lax) for each in value]


def _tuple(kind: Any, value: Any, lax: bool) -> Any:
    kinds = get_args(kind)
    if not (type(value) is tuple or (lax and type(value) is list)) or Ellipsis in kinds or len(kinds) != len(value):
        raise NotPlainError
    return tuple(plain_value(inner, each) for inner, each in zip(kinds, value, strict=True))


def _dict(kind: Any, value: Any, lax: bool) -> Any:
    if type(value) is not dict:
        raise NotPlainError
    of_key, of_value = get_args(kind)
    return {plain_value(of_key, key, lax): plain_value(of_value, each, lax) for key, each in value.items()}


_Check = Callable[[Any, Any, bool], Any]
_TYPES: dict[Any, _Check] = {
    Any: lambda _, value, __: value, str: _same, bool: _same, int: _same, NoneType: _same, float: _number, Path: _path,
}  # fmt: skip
_FORMS: dict[Any, _Check] = {
    Annotated: _annotated, Union: _one_of_several, UnionType: _one_of_several, Literal: _choice, list: _list,
    tuple: _tuple, dict: _dict,
}  # fmt: skip
