"""One alarm per cause: events that repeat are reported in growing steps, and each of them is recorded exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from livebode.nouns import Event

QUIET_S = 60.0
"""A cause that is silent for so long has ended; the next event of it begins another group."""
REPORT_S_MAX = 600.0
"""What repeats is reported at the latest after so long."""
REPEATS_MAX = 128
"""Most events that wait for the next report."""

CAUSES = {
    kind: cause
    for cause, kinds in {
        "loss": ("loss", "gap", "overflow"),
        "connection": ("connected", "disconnected", "restart"),
        "order": ("repeat", "reordered"),
        "sender": ("malformed", "foreign", "layout-changed", "unit-changed"),
        "clock": ("clock-jump", "wrong-rate"),
        "signal": ("non-finite", "implausible", "spike", "not-whole"),
        "fit": ("fit-failed", "fit-resumed"),
        "backlog": ("backlog", "backlog-cleared"),
        "thinned": ("thinned",),
    }.items()
    for kind in kinds
}
"""The cause of each kind of event that may repeat. All other kinds are reported one by one."""
_AT_ONCE = {"backlog", "backlog-cleared", "restart", "disconnected", "layout-changed", "unit-changed"}
"""Changes of state: who waited for their report would take the state before for the present one."""
_FIELDS = {"group", "count", "first_s", "last_s", "repeats"}


@dataclass
class _Group:
    """The events of one cause since it began."""

    name: str
    first_s: float
    last_s: float
    reported_s: float
    count: int = 0
    reported: int = 0
    kinds: list[str] = field(default_factory=list)
    waiting: list[Event] = field(default_factory=list)


class EventGroups:
    """Adds to each event of a run the group that it belongs to, and reports repeats in growing steps.

    A group is one cause (`CAUSES`) from its first event until it is silent for 60 s of the machine's time. Reported at
    once are changes of state, the first event of each kind in a group, and the 2nd, 4th, 8th, … of the group; the
    others wait for the next of these, for 600 s, for 128 of them, or for the end of the group or the run. What is
    reported is the newest event, and those that waited are in its details. No event is lost: `each_event` gives them
    back.

    The details get ``group`` (name, unique in the run), ``count`` (events in the group up to this one), ``first_s``,
    ``last_s`` (times of the first and the newest) and, where events waited, ``repeats``: kind, sample, time_s, message
    and details of each of them and of the newest.

    Examples
    --------
    >>> groups = EventGroups()
    >>> found = [groups.take(Event("gap", n, n / 1e3, "a gap")) for n in range(8)]
    >>> [event.details["count"] for events in found for event in events]
    [1, 2, 4, 8]
    >>> [event.sample for event in each_event(found[7][0])]
    [4, 5, 6, 7]
    """

    def __init__(self) -> None:
        self._groups: dict[str, _Group] = {}

    def take(self, event: Event) -> list[Event]:
        """What is to be reported now that this happened."""
        cause = CAUSES.get(event.kind)
        if cause is None:
            return [event]
        found = self.due(event.time_s, cause)
        group = self._groups.get(cause)
        if group is None:
            group = _Group(f"{cause}@{event.sample}", event.time_s, event.time_s, event.time_s)
            self._groups[cause] = group
        group.count += 1
        group.last_s = max(group.last_s, event.time_s)
        group.waiting.append(event)
        new = event.kind not in group.kinds
        if new:
            group.kinds.append(event.kind)
        if new or event.kind in _AT_ONCE or group.count >= 2 * group.reported or len(group.waiting) >= REPEATS_MAX:
            found.append(_report(group))
        return found

    def due(self, time_s: float, cause: str | None = None) -> list[Event]:
        """What is to be reported because the machine's time is now `time_s`; of one cause, or of all."""
        found = []
        for name, group in list(self._groups.items()):
            if cause not in (None, name):
                continue
            ended = time_s - group.last_s >= QUIET_S
            if group.waiting and (ended or time_s - group.reported_s >= REPORT_S_MAX):
                found.append(_report(group))
            if ended:
                del self._groups[name]
        return found

    def finish(self) -> list[Event]:
        """What still waits at the end of a run."""
        found = [_report(group) for group in self._groups.values() if group.waiting]
        self._groups.clear()
        return found

    def state(self) -> dict[str, Any]:
        """All of it as plain data; see `load`."""
        return {cause: asdict(group) for cause, group in self._groups.items()}

    def load(self, state: dict[str, Any]) -> None:
        """Continue from a state."""
        self._groups = {
            cause: _Group(**group | {"waiting": [Event(**event) for event in group["waiting"]]})
            for cause, group in state.items()
        }


def each_event(event: Event) -> Iterator[Event]:
    """Every event that a recorded one reports, as it was before it was grouped, in the order in which they happened."""
    if "repeats" not in event.details:
        yield replace(event, details={name: event.details[name] for name in event.details.keys() - _FIELDS})
        return
    for kind, sample, time_s, message, details in event.details["repeats"]:
        yield Event(kind, sample, time_s, message, dict(details))


def _report(group: _Group) -> Event:
    waiting, group.waiting = group.waiting, []
    newest = waiting[-1]
    group.reported, group.reported_s = group.count, group.last_s
    fields: dict[str, Any] = {
        "group": group.name,
        "count": group.count,
        "first_s": group.first_s,
        "last_s": group.last_s,
    }
    message = newest.message
    if len(waiting) > 1:
        fields["repeats"] = [[e.kind, e.sample, e.time_s, e.message, e.details] for e in waiting]
        message += f" ({group.count} events of this cause in {group.last_s - group.first_s:.4g} s)"
    return replace(newest, message=message, details=newest.details | fields)
