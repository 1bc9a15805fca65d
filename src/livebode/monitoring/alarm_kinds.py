"""Alarm kinds: which events are alarms, with which priority, and which event reports their end.

An alarm needs an action of a person; other events are only recorded. Three kinds of end exist:

- *reported*: another event reports that the condition has ended (`change-cleared`, `connected`, …);
- *at once*: the condition was over when it was reported, as with lost samples;
- *acknowledged*: the run does not report the end, so the alarm is active until somebody acknowledges it.

While the machine is not ready, alarms of its response are suppressed (ISA 18.2: suppressed by design); those of the
source and of the record are announced.
"""

from __future__ import annotations

from typing import Literal

from livebode.core import Event
from livebode.dataclass import dataclass
from livebode.records import group_of

Priority = Literal["high", "medium", "low"]
PRIORITIES: tuple[Priority, ...] = ("high", "medium", "low")
End = Literal["reported", "at once", "acknowledged"]

SOURCE = "source"
FAR = "change: machine"
"""Cause of a difference that is too large to be identified; it ends when another one is reported."""
_SUBJECTS = ("what", "reason", "status", "channel")
_CAUSE_MAX = 200


@dataclass(frozen=True)
class AlarmKind:
    """What an event of one kind means.

    Attributes
    ----------
    priority
        Of the alarm.
    end
        What ends it.
    cause
        Name of the alarm that several kinds share; empty: the event's group, or its kind and subject.
    of_response
        Whether it is an alarm of the machine's response, which is suppressed while the machine is not ready.
    """

    priority: Priority
    end: End
    cause: str = ""
    of_response: bool = False


ALARMS = {
    "change": AlarmKind("high", "reported", of_response=True),
    "change-corrected": AlarmKind("high", "reported", of_response=True),
    "record-paused": AlarmKind("high", "reported", "record-paused"),
    "record-damaged": AlarmKind("high", "acknowledged"),
    "disconnected": AlarmKind("high", "reported", SOURCE),
    "refused": AlarmKind("high", "reported", SOURCE),
    "waiting": AlarmKind("high", "reported", SOURCE),
    "loss": AlarmKind("medium", "at once"),
    "gap": AlarmKind("medium", "at once"),
    "overflow": AlarmKind("medium", "at once"),
    "phase-slip": AlarmKind("medium", "at once"),
    "restart": AlarmKind("medium", "at once", "restart"),
    "backlog": AlarmKind("medium", "reported", "backlog"),
    "record-unclosed": AlarmKind("medium", "reported", "record-unclosed"),
    "not-monitored": AlarmKind("medium", "reported", "not-monitored", of_response=True),
    "baseline-unknown": AlarmKind("medium", "acknowledged", of_response=True),
    "doubtful": AlarmKind("medium", "acknowledged", of_response=True),
    "roles-doubtful": AlarmKind("medium", "acknowledged", of_response=True),
    "window-doubtful": AlarmKind("medium", "acknowledged", of_response=True),
    "layout-changed": AlarmKind("medium", "acknowledged", "layout-changed"),
    "unit-changed": AlarmKind("medium", "acknowledged", "unit-changed"),
    "wrong-rate": AlarmKind("low", "acknowledged", "wrong-rate"),
    "clock-jump": AlarmKind("low", "at once", "clock-jump"),
}
"""The events that are alarms. docs/how-to/dashboard.md explains the choice."""

UNMONITORED = ("not-monitored", "idle", "monitored-again")
"""The events that report the beginning and the end of time in which a change would not be found."""

RETURNS = {
    "change-cleared": "",
    "record-resumed": "record-paused",
    "connected": SOURCE,
    "resumed": SOURCE,
    "backlog-cleared": "backlog",
    "record-closed": "record-unclosed",
    "monitored-again": "not-monitored",
}
"""The events that report an end, each with the cause of the alarm; empty: as for ``change``."""


def cause_of(event: Event) -> str:
    """The common cause of events that are shown as one: their alarm, their group in the run, or kind and subject.

    >>> cause_of(Event("gap", 7, 1.0, "a gap", {"group": "loss@7", "count": 1}))
    'loss'
    >>> cause_of(Event("change", 7, 1.0, "changed", {"what": "stiffness"}))
    'change: stiffness'
    >>> cause_of(Event("change-cleared", 7, 1.0, "as before", {"what": "stiffness", "place_m": 0.35}))
    'change: stiffness at 0.35'
    >>> cause_of(Event("connected", 7, 1.0, "connected", {"group": "connection@7", "count": 2}))
    'source'
    """
    kind = event.kind
    if kind.startswith("change") and "what" in event.details:
        place = event.details.get("place_m")
        where = f" at {place:.6g}" if isinstance(place, int | float) else ""
        return f"change: {event.details['what']}{where}"[:_CAUSE_MAX]
    fixed = ALARMS[kind].cause if kind in ALARMS else RETURNS.get(kind, "")
    if fixed:
        return fixed
    if (group := group_of(event)) is not None:
        return group[0].partition("@")[0]
    subjects = [str(event.details[name]) for name in _SUBJECTS if name in event.details]
    return ": ".join([kind, *subjects[:1]])[:_CAUSE_MAX]
