"""Extent of damage in the files of a record, in numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any

from livebode.core import Event
from livebode.dataclass import dataclass
from livebode.language import Message

KIND = "record-damaged"
_SHOWN = 3
_WITHOUT_ROWS = (None, "run.json", "run-copy.json", "events.jsonl")


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
        begin, end = (
            None if (moment := values[name]) is None else (int(moment[0]), float(moment[1]))
            for name in ("begin", "end")
        )
        rows = {str(table): int(number) for table, number in values["rows"].items()}
        return cls(int(values["size_bytes"]), begin, end, rows, values.get("at_least") is True)

    def to_json(self) -> dict[str, Any]:
        begin, end = (None if moment is None else list(moment) for moment in (self.begin, self.end))
        losses = {"rows": dict(self.rows), "at_least": self.at_least}
        return {"size_bytes": self.size_bytes, "begin": begin, "end": end, **losses}

    @property
    def sentence(self) -> str:
        """Description of the loss.

        >>> Damage(120, (400, 0.4), (500, 0.5), {"responses": 20}).sentence
        '20 rows of responses are lost, of samples 400 to 499 (0.1 s)'
        """
        if self.begin is None:
            return Message("its first {size} bytes are lost", size=self.size_bytes)
        if self.end is None:
            return Message(
                "its last {size} bytes are lost, from sample {first}", size=self.size_bytes, first=self.begin[0]
            )
        if not self.rows:
            return Message("nothing is lost")
        rows = Message.conjunction(
            Message("{rows} rows of {table}", rows=number, table=table) for table, number in self.rows.items()
        )
        lost = Message(
            "{rows} are lost, of samples {first} to {last}",
            rows=Message("at least {rows}", rows=rows) if self.at_least else rows,
            first=self.begin[0],
            last=self.end[0] - 1,
        )
        seconds = self.end[1] - self.begin[1]
        return Message("{lost} ({seconds:.4g} s)", lost=lost, seconds=seconds) if seconds > 0 else lost


def event_of(name: str, damages: Iterable[Damage], kept_as: str | None) -> Event:
    """One event for all damaged places of a journal; `kept_as` is the path of the retained file."""
    places = list(damages)
    lost: list[str] = [place.sentence for place in places[:_SHOWN]]
    if len(places) > _SHOWN:
        lost.append(Message("and {count} more", count=len(places) - _SHOWN))
    if kept_as:
        lost.append(Message("the file is retained as {path}", path=kept_as))
    message = Message("{file} is damaged: {what}", file=name, what=lost)
    details = {"retained": kept_as, "places": [place.to_json() for place in places], **total(places)}
    return Event(KIND, *(places[0].begin or (0, 0.0)), message, details)


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


def loses_rows(damage: Event, table: str) -> bool:
    """Whether rows of a table may be lost by this damage; where it is not counted, of any table."""
    details = damage.details
    if details.get("file") in _WITHOUT_ROWS:
        return False
    if rows := details.get("rows"):
        return table in rows
    if (places := details.get("places")) is not None:
        return any(place["begin"] is None or place["end"] is None for place in places)
    return details.get("journals") != []  # no journal's line of the manifest is lost if each has an intact copy
