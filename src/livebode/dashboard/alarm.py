"""The state of one alarm, as ISA 18.2 and IEC 62682 name the states, and the history of all."""

from __future__ import annotations

from collections import deque
from dataclasses import asdict, field, replace
from math import isfinite
from typing import Any, Literal

from livebode.core import Event
from livebode.dataclass import dataclass
from livebode.language import for_page
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
        """Acknowledge the alarm by this event."""
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
        """Whether the alarm chatters at this time of the run."""
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
    facts = {name: details.get(name) for name in _FACTS}
    changes = details.get("changes")
    if isinstance(changes, list) and changes and isinstance(changes[0], dict):
        facts |= {name: changes[0].get(name) for name in _ITEM}
    return {name: value for name, value in facts.items() if _plain(value)}


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


What = Literal[
    "raised", "returned", "acknowledged", "shelved", "unshelved", "suppressed", "unsuppressed", "chattering"
]  # fmt: skip
ROWS_MAX = 1000
_MESSAGE_MAX = 400


@dataclass(frozen=True)
class Transition:
    """One change of an alarm.

    Attributes
    ----------
    number, version
        Of the row, and of its last change.
    time_s
        Time of the run.
    cause, kind, words
        Of the alarm, and of the event that caused the change.
    what
        What happened.
    state
        State of the alarm after it.
    by, comment
        Person, and what they wrote.
    count
        Number of events: more than one where a chattering alarm, or a flood, is one row.
    """

    number: int
    version: int
    time_s: float
    cause: str
    kind: str
    words: str
    what: What
    state: str
    by: str = ""
    comment: str = ""
    count: int = 1


def limited(message: str, letters: int) -> str:
    """The message, or the beginning of its text if it is longer."""
    return message if len(message) <= letters else message[:letters]


class AlarmHistory:
    """The newest transitions, oldest first. While an alarm chatters, all its transitions share a row."""

    def __init__(self) -> None:
        self._rows: deque[Transition] = deque(maxlen=ROWS_MAX)
        self._numbered = 0
        self._chattering: dict[str, int] = {}  # number of the row of each chattering cause

    def add(self, version: int, what: What, time_s: float, chatters: bool = False, **facts: Any) -> None:
        """Add a transition; `chatters`: of an alarm that chatters."""
        cause = facts["cause"]
        if not chatters:
            self._chattering.pop(cause, None)
        index = self._place(self._chattering.get(cause)) if chatters else None
        count = facts.pop("count", 1)
        facts["words"] = limited(facts["words"], _MESSAGE_MAX)
        if index is not None:
            known = self._rows[index]
            count = known.count + (count if what == "raised" else 0)
            self._rows[index] = replace(known, version=version, time_s=time_s, count=count, **facts)
            return
        self._numbered += 1
        if chatters:
            what = "chattering"
            self._chattering[cause] = self._numbered
        self._rows.append(Transition(self._numbered, version, time_s, what=what, count=count, **facts))

    def since(self, version: int) -> list[dict[str, Any]]:
        """Rows that are new or changed after `version`, oldest first."""
        return [
            asdict(row) | {"message": str(row.words), "words": for_page(row.words)}
            for row in self._rows
            if row.version > version
        ]

    def _place(self, number: int | None) -> int | None:
        """Index of a row that is still there."""
        if number is None or not self._rows or number < self._rows[0].number:
            return None
        return number - self._rows[0].number
