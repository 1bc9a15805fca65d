"""Values for each key of a file's schema, to compare what the schema accepts with what livebode accepts."""

from __future__ import annotations

import copy
import datetime
from collections.abc import Iterator
from typing import Any

from jsonschema import Draft202012Validator

COMMON: list[Any] = [
    *(True, 0, 1, -1, 1.5, -1.5, "", "text", "auto", datetime.date(2026, 1, 1)),
    *([], [1.0], [1.0, 2.0], [1.0, 2.0, 3.0], ["text"], [True], [[1.0, 2.0]], [["text"]], [{}]),
    *({}, {"key": "text"}, {"key": 1.0}, {"key": True}),
]
Path = tuple[str, ...]


def validator(schema: dict[str, Any]) -> Draft202012Validator:
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def tables(schema: dict[str, Any], at: Path = (), here: dict[str, Any] | None = None) -> Iterator[tuple[Path, Any]]:
    """The tables of a file with their schemas, outside [axes]."""
    here = schema if here is None else here
    if "$ref" in here:
        here = schema["$defs"][here["$ref"].rpartition("/")[2]]
    if "properties" not in here:
        return
    yield at, here
    for name, inner in here["properties"].items():
        if name != "axes":
            yield from tables(schema, (*at, name), inner)


def values_of(key: dict[str, Any]) -> Iterator[Any]:
    """Values of every type, and those at and just outside the limits of a key."""
    if "$ref" in key:
        yield from (value for value in COMMON if not isinstance(value, dict))
        return
    yield from COMMON
    for one in (key, *key.get("anyOf", [])):
        yield from one.get("enum", [one["const"]] if "const" in one else [])
        for limit in ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"):
            if limit in one:
                step = 1 if one["type"] == "integer" else max(abs(one[limit]), 1e-9) / 2
                yield from (one[limit] - step, one[limit], one[limit] + step)


def with_value(data: dict[str, Any], at: Path, value: Any) -> dict[str, Any]:
    """The data with another value at this place."""
    found = copy.deepcopy(data)
    table = found
    for name in at[:-1]:
        table = table.setdefault(name, {})
    table[at[-1]] = value
    return found
