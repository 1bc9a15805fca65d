"""Notices: the events of a run as the page shows them, one for each cause, with the number acknowledged."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any

from livebode.core import Event
from livebode.records.grouped_events import event_counts, group_of

ACKNOWLEDGED = "acknowledged"
CAUSES_MAX = 500
_KNOWN_MAX = 4096
_PLAIN_MAX = 4000  # letters of a message
_SUBJECTS = ("what", "reason", "status", "channel")


@dataclass
class Notice:
    """The events of one cause in a run.

    Attributes
    ----------
    cause
        Identifier of the common cause.
    id, kind, message
        Of the newest event.
    first_s, last_s
        Times of the first and of the newest event.
    count, seen
        Number of events, and of acknowledged events.
    changed
        Version of the last change.
    """

    cause: str
    id: str
    kind: str
    message: str
    first_s: float
    last_s: float
    count: int = 0
    seen: int = 0
    changed: int = 0
    kinds: set[str] = field(default_factory=set)
    _group: str = ""
    _before: int = 0

    def take(self, event: Event) -> None:
        """Add an event, or as many as a grouped event counts."""
        if self.seen >= self.count:
            self.kinds = set()
        self.kinds |= event_counts(event).keys()
        self.id, self.kind, self.message = event_id(event), event.kind, event.message[:_PLAIN_MAX]
        if (group := group_of(event)) is not None:
            if group[0] != self._group:  # the same cause again, after a pause
                self._group, self._before = group[0], self.count
            self.count = max(self.count, self._before + group[1])
        else:
            self.count += 1
        self.last_s = max(self.last_s, event.time_s)

    def plain(self) -> dict[str, Any]:
        """Plain data for the page."""
        names = ("cause", "id", "kind", "message", "first_s", "last_s", "count", "seen")
        return {name: getattr(self, name) for name in names} | {"kinds": sorted(self.kinds)}


class EventCauses:
    """The causes of a run's events, the newest last."""

    def __init__(self) -> None:
        self.version = 0
        self.counts: dict[str, int] = {}
        self.changed: set[str] = set()
        """Names of the active differences from the baseline."""
        self._shown: OrderedDict[str, Notice] = OrderedDict()
        self._known: OrderedDict[str, tuple[str, int]] = OrderedDict()  # cause, and which of its events

    def take(self, event: Event) -> None:
        """Take an event or an acknowledgement."""
        self.version += 1
        if event.kind == ACKNOWLEDGED:
            self._acknowledged(event)
            return
        key = event_id(event)
        if key in self._known:
            return
        cause = cause_of(event)
        if event.kind in ("change", "change-corrected"):
            self.changed.add(str(event.details.get("what", "machine")))
        elif event.kind == "change-cleared":
            self.changed.discard(str(event.details.get("what", "machine")))
        notice = self._shown.get(cause)
        if notice is None:
            first_s = event.details.get("first_s")
            began_s = float(first_s) if isinstance(first_s, int | float) else event.time_s
            notice = Notice(cause, key, event.kind, "", began_s, event.time_s)
            self._shown[cause] = notice
        before = notice.count
        notice.take(event)
        self.counts[event.kind] = self.counts.get(event.kind, 0) + notice.count - before
        notice.changed = self.version
        self._shown.move_to_end(cause)
        self._known[key] = cause, notice.count
        for held, most in ((self._shown, CAUSES_MAX), (self._known, _KNOWN_MAX)):
            if len(held) > most:
                held.popitem(last=False)

    def of(self, key: str) -> tuple[Notice, int] | None:
        """The notice of an event, and the number of the event in it."""
        cause, number = self._known.get(key, ("", 0))
        notice = self._shown.get(cause)
        return None if notice is None else (notice, number)

    def since(self, version: int) -> list[dict[str, Any]]:
        """Notices that are new or changed after `version`, oldest first."""
        return [notice.plain() for notice in self._shown.values() if notice.changed > version]

    def _acknowledged(self, event: Event) -> None:
        found = self.of(str(event.details.get("event")))
        # Earlier versions used other names for the events of a group.
        known = self._shown.get(str(event.details.get("cause"))) if found is None else found[0]
        if known is None:
            return
        notice, count = known, event.details.get("count")
        # Runs from before the grouping of causes acknowledge each event individually.
        seen = max(notice.seen, count) if isinstance(count, int) else notice.seen + 1
        notice.seen, notice.changed = min(seen, notice.count), self.version


def cause_of(event: Event) -> str:
    """The common cause of events that are shown as one: their group in the run, or kind and subject.

    >>> cause_of(Event("gap", 7, 1.0, "a gap", {"group": "loss@7", "count": 1}))
    'loss'
    >>> cause_of(Event("change", 7, 1.0, "changed", {"what": "stiffness"}))
    'change: stiffness'
    """
    if (group := group_of(event)) is not None:
        return group[0].partition("@")[0]
    subjects = [str(event.details[name]) for name in _SUBJECTS if name in event.details]
    return ": ".join([event.kind, *subjects[:1]])[:200]


def event_id(event: Event) -> str:
    """A name of an event that is the same whenever the record is read; in a group, of it and all earlier ones."""
    group = group_of(event)
    text = f"{event.kind}\0{event.sample}\0{event.time_s!r}\0{event.message}" if group is None else f"{group}"
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def acknowledgement(notice: Notice, key: str, count: int, sample: int, time_s: float) -> Event:
    """The event that records the acknowledgement of `count` events of a cause, of which `key` is the last."""
    details = {"event": key, "kind": notice.kind, "time_s": notice.last_s, "cause": notice.cause, "count": count}
    often = f" ({count} events of this cause)" if count > 1 else ""
    return Event(ACKNOWLEDGED, sample, time_s, f"acknowledged: {notice.message}{often}", details)
