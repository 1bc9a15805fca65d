"""JSON as livebode writes it: without NaN, with the name and the version of its format."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from livebode.core import RecordError


def to_json(value: Any, indent: int | None = None) -> str:
    """The value as JSON text.

    >>> to_json({"sigma": float("nan"), "lines": (1, 2)})
    '{"sigma": null, "lines": [1, 2]}'
    """
    return json.dumps(_plain(value), ensure_ascii=False, indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


VERSIONS = {"run": 2, "manifest": 2, "journal": 1, "references": 1, "notes": 1, "loop check": 1}
"""Newest readable versions: layout of a run directory, manifest.jsonl, journal, references.json, notes.json and
loop-check.json."""


def format_of(name: str, version: int | None = None) -> dict[str, Any]:
    """What a file of this format begins with, by default of the newest version.

    >>> format_of("manifest")
    {'format': 'livebode manifest', 'version': 2}
    """
    return {"format": f"livebode {name}", "version": version or VERSIONS[name]}


def check_version(path: Path, name: str, found: Any) -> None:
    """RecordError if this file is of a newer version than this livebode reads."""
    if type(found) is int and found > VERSIONS[name]:
        raise RecordError(
            "newer-version",
            f"{str(path)!r} has version {found} of its format, and this livebode reads up to version {VERSIONS[name]}",
            "update livebode",
            path=str(path),
            format=name,
            found=found,
            readable=VERSIONS[name],
        )
