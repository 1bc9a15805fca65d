"""Events of one cause in one line of events.jsonl: how they are written, and read one by one or counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace

from livebode.core import Event
from livebode.dataclass import dataclass

_FIELDS = {"group", "count", "first_s", "last_s", "repeats", "counted"}  # that a group adds


def each_event(event: Event) -> Iterator[Event]:
    """Every event in a recorded one, as it was before grouping, in order of time.

    Events of a flood that were only counted are missing: see `event_counts`.
    """
    repeats = _repeats(event)
    if not repeats:
        added = set() if group_of(event) is None else _FIELDS
        yield replace(event, details={name: event.details[name] for name in event.details.keys() - added})
    yield from repeats


def event_counts(event: Event) -> Counter[str]:
    """Number of events of each kind in a recorded one, including those that were only counted.

    >>> line = Event("gap", 9, 0.9, "a gap", {"repeats": [["gap", 8, 0.8, "", {}], ["loss", 9, 0.9, "", {}]],
    ...                                       "counted": {"gap": 40}})
    >>> sorted(event_counts(line).items())
    [('gap', 41), ('loss', 1)]
    """
    counts, counted = Counter(each.kind for each in each_event(event)), event.details.get("counted")
    if isinstance(counted, dict):
        counts.update({str(kind): number for kind, number in counted.items() if type(number) is int and number > 0})
    return counts


def _repeats(event: Event) -> list[Event]:
    """Events in the event's details; none if they are not in the form of a run, because a record is untrusted data."""
    repeats = event.details.get("repeats")
    try:
        events = [Event(*repeat) for repeat in repeats] if isinstance(repeats, list) else []
    except TypeError:
        return []
    shape: tuple[type | tuple[type, ...], ...] = (str, int, (int, float), str, dict)
    plain = all(isinstance(value, kind) for each in events for value, kind in zip(vars(each).values(), shape))
    return events if plain else []


def group_of(event: Event) -> tuple[str, int] | None:
    """Name of an event's group, and number of events of the group up to it; None without a group."""
    name, count = event.details.get("group"), event.details.get("count")
    return (name, count) if isinstance(name, str) and type(count) is int else None


def still_waiting(events: Iterable[Event], waiting: Iterable[Event]) -> Iterator[Event]:
    """These events, then those of `waiting` that no line of their group reports yet."""
    reported: dict[str, int] = {}
    for event in events:
        if (group := group_of(event)) is not None:
            reported[group[0]] = group[1]
        yield event
    for event in waiting:
        if (group := group_of(event)) is not None and group[1] > reported.get(group[0], 0):
            yield event


@dataclass
class EventRow:
    """The events of one kind in one group, or a single event without one.

    Attributes
    ----------
    newest
        The newest of them with sample, time and message; for those that were only counted, these are not known.
    count
        Number of events.
    first_s, last_s
        Times of the first and of the newest, or of the line that counts it.
    """

    newest: Event
    count: int
    first_s: float
    last_s: float


def event_rows(events: Iterable[Event]) -> list[EventRow]:
    """One row for each kind of event in a group, and for each event without a group, in order of the first event."""
    rows: list[EventRow] = []
    of: dict[tuple[str, str], EventRow] = {}
    for event in events:
        group = group_of(event)
        if group is None:
            rows.append(EventRow(event, 1, event.time_s, event.time_s))
            continue
        known = {each.kind: each for each in each_event(event)}
        for kind, count in event_counts(event).items():
            row = of.get((group[0], kind))
            newest = known.get(kind) or (
                row.newest if row else replace(event, kind=kind, message="counted", details={})
            )
            if row is None:
                first_s = next((each.time_s for each in each_event(event) if each.kind == kind), newest.time_s)
                row = of[group[0], kind] = EventRow(newest, 0, first_s, newest.time_s)
                rows.append(row)
            fields = {name: event.details[name] for name in ("group", "count") if name in event.details}
            row.newest = replace(newest, details=newest.details | fields)
            row.count, row.last_s = row.count + count, known.get(kind, event).time_s
    return rows
