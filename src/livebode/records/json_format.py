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


VERSIONS = {"run": 3, "manifest": 3, "journal": 1, "references": 1, "notes": 1, "loop check": 1}
"""Versions that are written and read: layout of a run directory, manifest.jsonl, journal, references.json, notes.json
and loop-check.json."""


def format_of(name: str) -> dict[str, Any]:
    """What a file of this format begins with.

    >>> format_of("manifest")
    {'format': 'livebode manifest', 'version': 3}
    """
    return {"format": f"livebode {name}", "version": VERSIONS[name]}


def check_version(path: Path, name: str, version: Any) -> None:
    """RecordError if this file has another version of its format than the one that this livebode reads."""
    readable = VERSIONS[name]
    if type(version) is not int or version == readable:
        return
    message = f"{str(path)!r} has version {version} of its format, and this livebode reads version {readable}"
    facts = {"path": str(path), "format": name, "found": version, "readable": readable}
    if version > readable:
        raise RecordError("newer-version", message, "update livebode", **facts)
    raise RecordError("older-version", message, "run the recording again", **facts)
