"""Extent of damage in the files of a record, in numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from livebode.core import Event

KIND = "record-damaged"
_SHOWN = 3


Moment = tuple[int, float]
"""Number of a sample, and its time in seconds."""


@dataclass(frozen=True)
class Damage:
    """A damaged place in a journal, between two intact commits.

    Attributes
    ----------
    size_bytes
        Length of the damaged part.
    begin, end
        The first sample of the span between the two commits, and the first one after it. None if the damage is at
        the journal's beginning or end, so that one of the two commits is missing.
    rows
        Number of lost rows of each table. Empty if there are none, or if they cannot be counted.
    at_least
        Whether more may be lost than is counted.
    """

    size_bytes: int
    begin: Moment | None
    end: Moment | None
    rows: Mapping[str, int] = field(default_factory=dict)
    at_least: bool = False

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Damage:
        """From `to_json`; ValueError, TypeError or KeyError for other data."""
        begin, end = (None if (at := values[name]) is None else (int(at[0]), float(at[1])) for name in ("begin", "end"))
        rows = {str(table): int(number) for table, number in values["rows"].items()}
        return cls(int(values["size_bytes"]), begin, end, rows, values.get("at_least") is True)

    def to_json(self) -> dict[str, Any]:
        begin, end = (None if at is None else list(at) for at in (self.begin, self.end))
        rest = {"rows": dict(self.rows), "at_least": self.at_least}
        return {"size_bytes": self.size_bytes, "begin": begin, "end": end, **rest}

    @property
    def sentence(self) -> str:
        """Description of the loss.

        >>> Damage(120, (400, 0.4), (500, 0.5), {"responses": 20}).sentence
        '20 rows of responses are lost, of samples 400 to 499 (0.1 s)'
        """
        rows = " and ".join(f"{number} rows of {table}" for table, number in self.rows.items())
        if self.begin is None:
            return f"its first {self.size_bytes} bytes are lost"
        if self.end is None:
            return f"its last {self.size_bytes} bytes are lost, from sample {self.begin[0]}"
        if not rows:
            return "nothing is lost"
        rows = "at least " * self.at_least + rows
        seconds = f" ({self.end[1] - self.begin[1]:.4g} s)" if self.end[1] > self.begin[1] else ""
        return f"{rows} are lost, of samples {self.begin[0]} to {self.end[0] - 1}{seconds}"


def event_of(name: str, damages: Iterable[Damage], kept_as: str | None) -> Event:
    """One event for all damaged places of a journal; `kept_as` is the path of the retained file."""
    places = list(damages)
    lost = "; ".join(place.sentence for place in places[:_SHOWN]) + f"; and {len(places) - _SHOWN} more" * (
        len(places) > _SHOWN
    )
    kept = f"; the file is retained as {kept_as}" if kept_as else ""
    details = {"file": name, "retained": kept_as, "places": [place.to_json() for place in places], **total(places)}
    return Event(KIND, *(places[0].begin or (0, 0.0)), f"{name} is damaged: {lost}{kept}", details)


def total(places: Iterable[Damage]) -> dict[str, Any]:
    """Samples and seconds of the spans in which rows are lost, and rows of each table; over all places.

    >>> total([Damage(9, (0, 0.0), (100, 0.1), {"samples": 100}), Damage(9, (300, 0.3), (400, 0.4))])
    {'samples': 100, 'seconds': 0.1, 'rows': {'samples': 100}}
    """
    samples, seconds, rows = 0, 0.0, dict[str, int]()
    for place in places:
        if place.rows and place.begin and place.end:
            samples += place.end[0] - place.begin[0]
            seconds += place.end[1] - place.begin[1]
        for table, number in place.rows.items():
            rows[table] = rows.get(table, 0) + number
    return {"samples": samples, "seconds": seconds, "rows": rows}
