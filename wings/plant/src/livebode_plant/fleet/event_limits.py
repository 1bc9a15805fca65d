"""EventLimits: events of an axis that repeat are stored at a limited rate, by the time of the machine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from livebode.core import Event, Stage, StatefulBase

BURST = 20
"""Events of a kind that are stored at once."""
PER_S = 0.1
"""Further ones of a kind."""
_FULL = {"change", "change-corrected", "change-cleared", "baseline-unknown", "not-monitored", "axis-failed"}
"""Alarms: each is stored."""


class EventLimits(StatefulBase):
    """Drops events of a kind beyond a rate; the next one that is stored has their number in ``details["more"]``.

    Which are dropped follows from the events of the kind alone, in their order: neither from the clock of a computer
    nor from how messages are taken together. The state continues the count, so a takeover repeats nothing.

    Examples
    --------
    >>> limits = EventLimits()
    >>> found = limits.process(Event("gap", n, n / 10, "a gap") for n in range(300))
    >>> len(found), found[20].details
    (22, {'more': 80})
    """

    _stage = Stage("event-limits", 1)

    def __init__(self) -> None:
        self._kinds: dict[str, tuple[float, float, int]] = {}
        """Each kind's events that may be stored at once, time of the newest event, and how many were dropped."""

    def process(self, events: Iterable[Event]) -> list[Event]:
        """Events of these that are stored."""
        return [stored for event in events for stored in ([event] if event.kind in _FULL else self._limited(event))]

    def _limited(self, event: Event) -> list[Event]:
        room, then_s, dropped = self._kinds.get(event.kind, (float(BURST), event.time_s, 0))
        room = min(float(BURST), room + PER_S * max(0.0, event.time_s - then_s))
        stored = room >= 1
        newest_s = max(then_s, event.time_s)
        self._kinds[event.kind] = (room - 1, newest_s, 0) if stored else (room, newest_s, dropped + 1)
        if not stored:
            return []
        more = dropped + event.details.get("more", 0)
        return [replace(event, details=event.details | {"more": more}) if more else event]

    def _state(self) -> dict[str, Any]:
        return {"kinds": {kind: list(self._kinds[kind]) for kind in sorted(self._kinds)}}

    def _load(self, state: dict[str, Any]) -> None:
        self._kinds = {str(kind): (float(a), float(b), int(n)) for kind, (a, b, n) in state["kinds"].items()}
