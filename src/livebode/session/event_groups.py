"""One alarm per cause: events that repeat are recorded one by one up to a rate, then in counted lines."""

from __future__ import annotations

from collections import Counter
from copy import deepcopy
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

from livebode.core import Event

QUIET_S = 60.0
"""A cause that is silent for so long has ended; the next event of it begins another group."""
AT_ONCE = 20
"""So many events of a group are reported one by one; those behind them share lines."""
REPORT_S, STATE_S = 10.0, 1.0
"""What shares a line is reported at the latest after so long, and a change of state after the shorter time."""
REPEATS_MAX = 128
"""Most events that share a line with sample, time and message of each."""
EXACT_MAX, EXACT_PER_S = 1000.0, 1.0
"""So many events of a group are exact at once, and so many each second in the long run; the others are only counted."""

CAUSES = {
    kind: cause
    for cause, kinds in {
        "loss": ("loss", "gap", "overflow", "phase-slip"),
        "connection": ("connected", "disconnected", "restart", "resumed"),
        "order": ("repeat", "reordered"),
        "sender": ("malformed", "foreign", "replaced", "layout-changed", "unit-changed"),
        "clock": ("clock-jump", "wrong-rate", "computer-clock"),
        "signal": ("non-finite", "implausible", "spike", "not-whole"),
        "fit": ("fit-failed", "fit-resumed"),
        "backlog": ("backlog", "backlog-cleared"),
        "thinned": ("thinned",),
    }.items()
    for kind in kinds
}
"""The cause of each kind of event that may repeat. All other kinds are reported one by one."""
_STATES = {"backlog", "backlog-cleared", "restart", "replaced", "disconnected", "layout-changed", "unit-changed"}
"""Changes of state, which are reported soon: until then the previous state would look like the present one."""


@dataclass
class _Group:
    """The events of one cause since it began."""

    name: str
    first_s: float
    last_s: float
    reported_s: float
    count: int = 0
    lines: int = 0
    exact: float = EXACT_MAX
    kinds: list[str] = field(default_factory=list)
    waiting: list[Event] = field(default_factory=list)
    counted: dict[str, int] = field(default_factory=dict)
    newest: Event | None = None
    """The newest event where it was only counted."""

    @property
    def waits(self) -> bool:
        return bool(self.waiting) or self.newest is not None

    def add(self, event: Event) -> None:
        self.count += 1
        self.exact = min(EXACT_MAX, self.exact + EXACT_PER_S * max(0.0, event.time_s - self.last_s))
        self.last_s = max(self.last_s, event.time_s)
        if self.exact >= 1:
            self.exact -= 1
            self.waiting.append(event)
            self.newest = None
        else:
            self.counted[event.kind] = self.counted.get(event.kind, 0) + 1
            self.newest = event

    def due(self, time_s: float) -> bool:
        if self.lines < AT_ONCE or len(self.waiting) >= REPEATS_MAX:
            return True
        changed = any(event.kind in _STATES for event in (*self.waiting, *filter(None, [self.newest])))
        return time_s - self.reported_s >= (STATE_S if changed else REPORT_S)

    def report(self, time_s: float = 0.0) -> Event:
        """One event at `time_s` for all that wait, which then do not wait any longer."""
        exact, counted = self.waiting, Counter(self.counted)
        if self.newest is not None:  # of the newest one everything is in the line anyway
            counted[self.newest.kind] -= 1
            exact = [*exact, self.newest]
        self.waiting, self.counted, self.newest = [], {}, None
        self.lines, self.reported_s = self.lines + 1, max(time_s, self.last_s)
        details: dict[str, Any] = {"group": self.name, "count": self.count}
        details |= {"first_s": self.first_s, "last_s": self.last_s}
        message = exact[-1].message
        if len(exact) > 1 or counted.total():
            details["repeats"] = [[e.kind, e.sample, e.time_s, e.message, e.details] for e in exact]
            message += f" ({self.count} events of this cause in {self.last_s - self.first_s:.4g} s)"
        if counted.total():
            details["counted"] = {kind: number for kind, number in counted.items() if number}
        return replace(exact[-1], message=message, details=exact[-1].details | details)


class EventGroups:
    """Adds to each event of a run the group that it belongs to, and bounds how fast a cause is reported.

    A group is one cause (`CAUSES`) from its first event until it is silent for 60 s of the machine's time. Its first 20
    events are reported at once, one by one, and so is the first event of each kind. What comes then shares a line: the
    newest event, with the others in its details, after 10 s (after 1 s where a state changed; of this computer where
    the machine is silent), with 128 of them, or at the end of the group or the run. Until then they are `waiting`,
    which the record stores with every commit.

    A flood is counted: of a group 1,000 events are reported with sample, time and message of each, and one more each
    second. `livebode.records.grouped_events` reads events back one by one, or counts them.

    The details get ``group`` (name, unique in the run), ``count`` (events in the group up to this one), ``first_s``,
    ``last_s`` (times of the first and the newest) and, where events share the line, ``repeats``: kind, sample, time_s,
    message and details of each of them and of the newest, and ``counted``: how many of each kind were only counted.

    Examples
    --------
    >>> groups = EventGroups()
    >>> found = [groups.take(Event("gap", n, n / 1e3, "a gap")) for n in range(30)]
    >>> sum(map(len, found)), found[19][0].details["count"]
    (20, 20)
    >>> [event.details["count"] for event in groups.waiting()]
    [30]
    """

    def __init__(self) -> None:
        self._groups: dict[str, _Group] = {}
        self._silent_s: dict[str, float] = {}  # since when each cause waits, in `due_while_silent`

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
        group.add(event)
        new = event.kind not in group.kinds
        if new:
            group.kinds.append(event.kind)
        if new or group.due(event.time_s):
            found.append(group.report(event.time_s))
        return found

    def due(self, time_s: float, cause: str | None = None) -> list[Event]:
        """What is to be reported because the machine's time is now `time_s`; of one cause, or of all."""
        found = []
        for name, group in list(self._groups.items()):
            if cause not in (None, name):
                continue
            ended = time_s - group.last_s >= QUIET_S
            if group.waits and (ended or group.due(time_s)):
                found.append(group.report(time_s))
            if ended:
                del self._groups[name]
        return found

    def due_while_silent(self, now_s: float) -> list[Event]:
        """What is to be reported at `now_s` of this computer, while the machine's time does not pass."""
        found = []
        for cause, group in self._groups.items():
            if group.waits:
                waited_s = now_s - self._silent_s.setdefault(cause, now_s)
                if group.due(group.reported_s + waited_s):
                    found.append(group.report())
                    self._silent_s[cause] = now_s
        return found

    def waiting(self) -> list[Event]:
        """What is not reported yet, as it would be now."""
        return [deepcopy(group).report() for group in self._groups.values() if group.waits]

    def finish(self) -> list[Event]:
        """What still waits at the end of a run."""
        found = [group.report() for group in self._groups.values() if group.waits]
        self._groups.clear()
        return found

    def state(self) -> dict[str, Any]:
        """All of it as plain data; see `load`."""
        return {cause: asdict(group) for cause, group in self._groups.items()}

    def load(self, state: dict[str, Any]) -> None:
        """Continue from a state."""
        self._groups = {cause: _restored(group) for cause, group in state.items()}


def _restored(state: dict[str, Any]) -> _Group:
    known = {one.name: state[one.name] for one in fields(_Group) if one.name in state}
    events = {"waiting": [Event(**event) for event in state["waiting"]]}
    newest = state.get("newest")
    return _Group(**known | events | {"newest": None if newest is None else Event(**newest)})
