"""Signal names that a nested recording contains, in place of the MATLAB paths."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from livebode.sources.recording import Column
from livebode.sources.timing import DSPACE_TIME
from livebode.sources.units import split_unit


def with_friendly_names(columns: Sequence[Column], texts: Mapping[str, str]) -> tuple[Column, ...]:
    """Columns `….Data` named as the text of `….Name` says, in the unit of it or of `….Unit`; the path is an alias.

    dSPACE ControlDesk uses this layout. If a Name is a model path, its last part is the name, and the Name an alias.
    Where several columns would have one name, they keep their paths.

    >>> texts = {"rec.Y(2).Name": "Model Root/Speed/omega", "rec.Y(2).Unit": "rad/s"}
    >>> column, = with_friendly_names([Column("rec.Y(2).Data", "", 100)], texts)
    >>> column.name, column.unit, column.aliases
    ('omega', 'rad/s', ('rec.Y(2).Data', 'Model Root/Speed/omega'))
    """
    named = [with_friendly_name(column, texts) for column in columns]
    count = Counter(column.name for column in named)
    return tuple(
        column if count[column.name] == 1 or column.name == path.name else with_path(column, path.name)
        for column, path in zip(named, columns, strict=True)
    )


def with_friendly_name(column: Column, texts: Mapping[str, str]) -> Column:
    match = re.fullmatch(r"(?P<stem>.*)\.Data(?P<index>\([\d,]+\))?", column.name)
    if match is None:
        return column
    stem, index = match["stem"], match["index"] or ""
    given = texts.get(f"{stem}.Name", "").strip()
    bare, unit = split_unit(given)
    name = re.split(r"[/\\]", bare)[-1].strip('" ')
    unit = column.unit or texts.get(f"{stem}.Unit", "").strip() or unit
    if not name:
        return replace(column, unit=unit)
    own = column.name if DSPACE_TIME.search(column.name) else name + index
    others = dict.fromkeys(alias for alias in (column.name, given + index, name + index) if alias != own)
    return replace(column, name=own, unit=unit, aliases=(*column.aliases, *others))


def with_path(column: Column, path: str) -> Column:
    aliases = tuple(dict.fromkeys(alias for alias in (*column.aliases, column.name) if alias != path))
    return replace(column, name=path, aliases=aliases)
