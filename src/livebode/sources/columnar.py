"""Schemas of Parquet and Arrow files as columns of a recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from typing import NamedTuple

from livebode.sources.recording import COLUMNS_MAX, Column, Skipped, oversized
from livebode.sources.units import split_units

UNIT_KEYS = "unit", "units"


class Content(Enum):
    """What a column has."""

    NUMBER = "number"
    TIME = "time"
    OTHER = "other"


class StoredColumn(NamedTuple):
    """A column as its file describes it; `kind` is the name of its type there."""

    name: str
    content: Content
    kind: str
    metadata: Mapping[str, str]


def columns_of(stored: Sequence[StoredColumn], samples: int | None) -> tuple[tuple[Column, ...], tuple[Skipped, ...]]:
    """Columns of a recording; `key` is the number in the file. Units are from metadata, else from brackets in names.

    >>> columns, _ = columns_of([StoredColumn("u [V]", Content.NUMBER, "float", {})], 10)
    >>> [(c.name, c.unit) for c in columns]
    [('u', 'V')]
    """
    if len(stored) > COLUMNS_MAX:
        raise oversized(
            f"the file has {len(stored)} columns, more than {COLUMNS_MAX}", COLUMNS_MAX, columns=len(stored)
        )
    columns, skipped = [], []
    for at, (one, (name, unit)) in enumerate(zip(stored, split_units([one.name for one in stored]))):
        stated = next((one.metadata[key] for key in UNIT_KEYS if key in one.metadata), "")
        alias = () if name == one.name else (one.name,)
        if one.content is Content.TIME:
            columns.append(Column(name, "ns", samples, alias, temporal=True, key=at))
        elif one.content is Content.NUMBER:
            columns.append(Column(name, stated or unit, samples, alias, key=at))
        else:
            skipped.append(Skipped(name, f"its values are of type {one.kind}, not numbers"))
    return tuple(columns), tuple(skipped)


def scalars_of(metadata: Iterable[tuple[str, str]]) -> dict[str, float]:
    """Numbers in the metadata of a file, such as rate_hz."""
    numbers = {}
    for key, value in metadata:
        if len(value) < 40:
            try:
                numbers[key] = float(value)
            except ValueError:
                continue
    return numbers
