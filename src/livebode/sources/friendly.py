"""Signal names that a nested recording contains, in addition to the MATLAB paths."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from livebode.sources.recording import Column


def with_friendly_names(columns: Sequence[Column], texts: Mapping[str, str]) -> tuple[Column, ...]:
    """Columns `….Data` with the text of `….Name` as alias and that of `….Unit` as unit.

    dSPACE ControlDesk uses this layout; if a Name is a model path, its last part is also an alias.

    >>> texts = {"rec.Y(2).Name": "Model Root/Speed/omega", "rec.Y(2).Unit": "rad/s"}
    >>> column, = with_friendly_names([Column("rec.Y(2).Data", "", 100)], texts)
    >>> column.aliases, column.unit
    (('Model Root/Speed/omega', 'omega'), 'rad/s')
    """
    return tuple(with_friendly_name(column, texts) for column in columns)


def with_friendly_name(column: Column, texts: Mapping[str, str]) -> Column:
    match = re.fullmatch(r"(?P<stem>.*)\.Data(?P<index>\(\d+\))?", column.name)
    if match is None:
        return column
    stem, index = match["stem"], match["index"] or ""
    name = texts.get(f"{stem}.Name", "").strip()
    names = tuple(dict.fromkeys((name + index, re.split(r"[/\\]", name)[-1].strip('"') + index))) if name else ()
    unit = column.unit or texts.get(f"{stem}.Unit", "").strip()
    return replace(column, unit=unit, aliases=(*column.aliases, *names))
