"""The recipe of a run: everything in a configuration that its results depend on, without the data and its place."""

from __future__ import annotations

import hashlib
import json

from livebode.configuration.axis import Axis
from livebode.records import content_sha256

_READING = {"time", "clock", "from_", "to", "skip_periods", "dbc", "rate_hz", "kinds", "units"}
_APART = {"source", "serve", "record", "report", "machine", "publish"}
_DIGITS = 16


def recipe_id(axis: Axis) -> str:
    """The name of a recipe: the same recording gives the same results with each configuration of this name.

    16 hexadecimal digits of the SHA-256 of the configuration in JSON. Source, machine, [record], [report], [serve] and
    [[publish]] do not count, except how a recording is read (its time column, part, rate, kinds and DBC file). A
    baseline, a described gantry and a DBC file count by their content. A default counts as omitted, so that a new
    setting of a later version changes no name.

    Raises
    ------
    RecordingError
        If one of these files cannot be read.

    Examples
    --------
    >>> from livebode.configuration.axis import Axis
    >>> brief = {"source": {"log": "a.csv"}, "signals": {"output": "y"}}
    >>> full = {"source": {"log": "b.csv"}, "signals": {"output": "y"}, "tracking": {"average": False}}
    >>> recipe_id(Axis.of(brief, "a")) == recipe_id(Axis.of(full, "b"))
    True
    """
    plain = axis.model_dump(mode="json", by_alias=True, exclude=_APART, exclude_defaults=True)
    reading = axis.source.model_dump(mode="json", by_alias=True, include=_READING, exclude_defaults=True)
    if axis.source.dbc is not None:
        reading["dbc"] = content_sha256(axis.source.dbc)
    if reading:
        plain["source"] = reading
    for name in ("baseline", "gantry"):
        if (file := getattr(axis.monitoring, name)) is not None:
            plain["monitoring"][name] = content_sha256(file)
    text = json.dumps(plain, sort_keys=True, ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
