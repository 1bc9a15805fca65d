"""Tables in which every channel, or every few, have their own time column."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from livebode.dataclass import dataclass
from livebode.sources import Chunk, Column


@dataclass(frozen=True)
class TimedColumns:
    """A time column and the columns whose samples it dates."""

    time: Column
    channels: tuple[Column, ...]
    samples: int = 0


def merged(groups: Sequence[TimedColumns], times: Iterator[Chunk]) -> list[TimedColumns]:
    """The groups with their length, those of equal times as one, that with the most channels first.

    `times` are the chunks of the groups' time columns; behind its last sample a column is NaN.
    """
    lengths = [0] * len(groups)
    same = [0] * len(groups)  # the first group with equal times so far
    rows = 0
    for chunk in times:
        for index, values in enumerate(chunk):
            filled = np.flatnonzero(~np.isnan(values))
            lengths[index] = rows + int(filled[-1]) + 1 if filled.size else lengths[index]
        same = split(same, chunk)
        rows += len(chunk[0])
    united = [
        replace(
            groups[first],
            channels=tuple(c for index, group in enumerate(groups) if same[index] == first for c in group.channels),
            samples=lengths[first],
        )
        for first in dict.fromkeys(same)
    ]
    return sorted(united, key=lambda group: -len(group.channels))


def split(same: Sequence[int], chunk: Chunk) -> list[int]:
    """For each column the first one that equals it, among those that were equal before."""
    first: dict[tuple[int, bytes], int] = {}
    contents = (np.where(np.isnan(values), np.nan, values).tobytes() for values in chunk)
    return [first.setdefault(key, index) for index, key in enumerate(zip(same, contents, strict=True))]


def as_columns(groups: Sequence[TimedColumns]) -> list[Column]:
    """The columns with their lengths; several groups have clocks of their own, named after their first channel."""
    columns: list[Column] = []
    for group in groups:
        first = group.channels[0].name if len(groups) > 1 else ""
        name = f"{first}.{group.time.name}" if columns else group.time.name
        time = replace(group.time, name=name, clock=True)
        columns += [replace(column, samples=group.samples, group=first) for column in (time, *group.channels)]
    return columns


def trimmed(chunks: Iterator[Chunk], samples: int | None) -> Iterator[Chunk]:
    """The first `samples` rows of the chunks."""
    left = samples
    for chunk in chunks:
        yield [values[:left] for values in chunk]
        if left is not None and (left := left - len(chunk[0])) <= 0:
            return
