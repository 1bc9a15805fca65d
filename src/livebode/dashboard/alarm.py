"""The state of one alarm, as ISA 18.2 and IEC 62682 name the states."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Literal

from livebode.core import Event
from livebode.monitoring import AlarmKind

Condition = Literal["unacknowledged", "acknowledged", "returned", "normal"]
"""Active and not acknowledged; active and acknowledged; over but not acknowledged; over (and acknowledged)."""
AlarmState = Condition | Literal["shelved", "suppressed"]
"""Shelved by a person; suppressed by the state of the machine, so that the condition of an active alarm is unknown."""
OPEN = ("unacknowledged", "returned")
"""States that wait for an acknowledgement."""

CHATTER_TIMES, CHATTER_S = 3, 60.0
"""An alarm that is raised so many times in so many seconds of the machine's time chatters."""


@dataclass(frozen=True)
class AlarmShelf:
    """An alarm is not announced for a time: by whom, until when (seconds since 1970), and why."""

    by: str
    until_s: float
    reason: str

    def plain(self) -> dict[str, Any]:
        """Plain data for the page."""
        return {"by": self.by, "until_s": self.until_s, "reason": self.reason}


@dataclass
class AlarmStatus:
    """The alarm of one cause.

    Attributes
    ----------
    kind
        Of the newest event that raised it.
    active
        Whether its condition is present, as far as the run reports it.
    raised
        Number of the cause's events up to the one that raised it last: acknowledged if as many are acknowledged.
    since_s, at_s, returned_s
        Time of the run: when the condition began, when it was last reported, and when it ended (None: not yet).
    facts
        Plain facts of the newest report: what has changed, by how much, where.
    by, comment
        Of the newest acknowledgement.
    suppressions
        How often its suppression has ended since it was raised.
    """

    kind: AlarmKind
    active: bool = False
    raised: int = 0
    since_s: float = 0.0
    at_s: float = 0.0
    returned_s: float | None = None
    facts: dict[str, Any] = field(default_factory=dict)
    by: str = ""
    comment: str = ""
    suppressions: int = 0
    _times: deque[float] = field(default_factory=lambda: deque(maxlen=CHATTER_TIMES))

    def raise_by(self, event: Event, kind: AlarmKind, times: int, number: int) -> None:
        """An event, or `times` like it, reports the condition; it is the cause's event of this number."""
        if not self.active:
            since_s = number_in(event, "since_s")
            self.since_s, self.suppressions = event.time_s if since_s is None else since_s, 0
            self._times.extend([event.time_s] * min(times, CHATTER_TIMES))
        self.kind, self.at_s, self.raised, self.by, self.comment = kind, event.time_s, number, "", ""
        self.active = kind.end != "at once"
        self.returned_s = None if self.active else event.time_s
        self.facts = _facts(event.details)

    def end_at(self, time_s: float) -> None:
        """The condition has ended."""
        self.active, self.returned_s = False, time_s

    def acknowledge(self, event: Event) -> None:
        """It is acknowledged by this event."""
        self.by, self.comment = text_in(event, "by"), text_in(event, "comment")
        if self.active and self.kind.end == "acknowledged":
            self.end_at(event.time_s)

    def condition(self, seen: int) -> Condition:
        """The state without shelf; `seen` of the cause's events are acknowledged."""
        if seen < self.raised:
            return "unacknowledged" if self.active else "returned"
        return "acknowledged" if self.active else "normal"

    @property
    def chatters_until_s(self) -> float | None:
        """Time of the run until which it chatters; None if it does not."""
        full = len(self._times) == CHATTER_TIMES
        return self._times[0] + CHATTER_S if full and self._times[-1] - self._times[0] <= CHATTER_S else None

    def chatters_at(self, time_s: float) -> bool:
        """Whether it chatters at this time of the run."""
        until_s = self.chatters_until_s
        return until_s is not None and time_s <= until_s

    def plain(self) -> dict[str, Any]:
        """Plain data for the page."""
        names = ("since_s", "at_s", "returned_s", "facts", "by", "comment")
        return {name: getattr(self, name) for name in names} | {
            "priority": self.kind.priority,
            "chatters_until_s": self.chatters_until_s,
        }


_FACTS = ("what", "amount_percent", "bound_percent", "place_m", "reference", "entry")
_ITEM = ("name", "of", "amount", "unit")
_LETTERS_MAX = 100
_NUMBER_MAX = 1e15


def _facts(details: dict[str, Any]) -> dict[str, Any]:
    """What the first look needs; of a change at several lines or parameters, the most significant one."""
    found = {name: details.get(name) for name in _FACTS}
    changes = details.get("changes")
    if isinstance(changes, list) and changes and isinstance(changes[0], dict):
        found |= {name: changes[0].get(name) for name in _ITEM}
    return {name: value for name, value in found.items() if _plain(value)}


def _plain(value: object) -> bool:
    if isinstance(value, float):
        return isfinite(value)
    return isinstance(value, str | int) and len(str(value)) <= _LETTERS_MAX


def text_in(event: Event, name: str) -> str:
    """A text in the details of an event; empty if there is none."""
    value = event.details.get(name, "")
    return value[:400] if isinstance(value, str) else ""


def number_in(event: Event, name: str) -> float | None:
    """A finite number in the details of an event; None if there is none: a record is untrusted data."""
    value = event.details.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) < _NUMBER_MAX else None
