"""Counts of a run, and groups of its events by cause: many of one cause are few documents."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event, Stage, decode, encode, restore_parts
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.preparation import ChannelCheck

if TYPE_CHECKING:
    from livebode.runtime.continuing import PreviousRun


QUIET_S = 60.0
"""A cause without events for this time has ended; its next event begins another group."""
AT_ONCE = 20
"""Events of a group that are reported one by one; later ones share lines."""
REPORT_S, STATE_S = 10.0, 1.0
"""Longest time until events that share a line are reported; the shorter one for a change of state."""
REPEATS_MAX = 128
"""Most events that share a line with sample, time and message of each."""
EXACT_MAX, EXACT_PER_S = 1000.0, 1.0
"""Events of a group that are reported in full: at once, and per second over time; the others are only counted."""

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
        "publishing": ("sink-down", "sink-up", "sink-full", "sink-refused"),
        "readiness": ("suppressed", "suppression-ended"),
    }.items()
    for kind in kinds
}
"""The cause of each kind of event that may repeat. All other kinds are reported one by one."""
_STATES = {"backlog", "backlog-cleared", "restart", "replaced", "disconnected", "layout-changed", "unit-changed"}
_STATES |= {"suppressed", "suppression-ended"}
"""Changes of state; they are reported soon, because the record shows the previous state until then."""


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
    """The newest event if it was only counted."""

    def to_plain(self) -> dict[str, Any]:
        return asdict(self) if self.waits else dict(vars(self))  # the same, without a copy of what does not change

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
        """One event at `time_s` for all waiting ones, which are then removed."""
        exact, counted = self.waiting, Counter(self.counted)
        if self.newest is not None:  # the line itself contains the newest one
            counted[self.newest.kind] -= 1
            exact = [*exact, self.newest]
        self.waiting, self.counted, self.newest = [], {}, None
        self.lines, self.reported_s = self.lines + 1, max(time_s, self.last_s)
        details: dict[str, Any] = {"group": self.name, "count": self.count}
        details |= {"first_s": self.first_s, "last_s": self.last_s}
        message = exact[-1].message
        if len(exact) > 1 or counted.total():
            details["repeats"] = [[e.kind, e.sample, e.time_s, e.message, e.details] for e in exact]
            message = Message(
                "{event} ({count} events of this cause in {seconds:.4g} s)",
                event=exact[-1],
                count=self.count,
                seconds=self.last_s - self.first_s,
            )
        if counted.total():
            details["counted"] = {kind: number for kind, number in counted.items() if number}
        return replace(exact[-1], message=message, details=exact[-1].details | details)


class EventGroups:
    """Adds its group to each event of a run, and limits the rate of reports of one cause.

    A group is one cause (`CAUSES`) from its first event until it is silent for 60 s of the machine's time. Its first 20
    events are reported at once, one by one, and so is the first event of each kind. Later events share a
    line: the newest event, with the others in its details, after 10 s (after 1 s for a change of state; by this
    computer's clock if the machine sends nothing), with 128 of them, or at the end of the group or the run. Until then
    they are `waiting`, which the record stores with every commit.

    In a flood, events are only counted: of a group, 1,000 events are reported with sample, time and message, and one
    more each second. `livebode.records.grouped_events` reads events back one by one, or counts them.

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

    _stage = Stage("event-groups", 1)

    def __init__(self) -> None:
        self._groups: dict[str, _Group] = {}
        self._silent_s: dict[str, float] = {}  # start of waiting of each cause, in `due_while_silent`

    def take(self, event: Event) -> list[Event]:
        """Take an event; returns the events to report now."""
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
        """Events to report at machine time `time_s`; of one cause, or of all."""
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
        """Events to report at `now_s` of this computer, while the machine time does not advance."""
        found = []
        for cause, group in self._groups.items():
            if group.waits:
                waited_s = now_s - self._silent_s.setdefault(cause, now_s)
                if group.due(group.reported_s + waited_s):
                    found.append(group.report())
                    self._silent_s[cause] = now_s
        return found

    def waiting(self) -> list[Event]:
        """Events that are not reported yet, as they would be now."""
        return [deepcopy(group).report() for group in self._groups.values() if group.waits]

    def finish(self) -> list[Event]:
        """Waiting events at the end of a run."""
        found = [group.report() for group in self._groups.values() if group.waits]
        self._groups.clear()
        return found

    def snapshot(self) -> bytes:
        """State as bytes; see `restore`."""
        return encode(self._stage, {"groups": {cause: group.to_plain() for cause, group in self._groups.items()}})

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot; StateError, and nothing has changed, if that cannot be restored."""
        groups = decode(self._stage, snapshot)["groups"]
        self._groups = {cause: _restored(group) for cause, group in groups.items()}


def _restored(state: dict[str, Any]) -> _Group:
    events = {"waiting": [Event(**event) for event in state["waiting"]]}
    newest = None if state["newest"] is None else Event(**state["newest"])
    return _Group(**state | events | {"newest": newest})


_STAGE = Stage("run-counts", 1)


class RunCounts:
    """Counts over a whole run, also over a continued one.

    Parameters
    ----------
    check
        Checks the signals.
    started
        `time.perf_counter()` at the beginning.
    before
        The run that this one continues.

    Attributes
    ----------
    stop
        Number of the sample after the last tracked one.
    groups
        The events of each cause.
    left_out_samples
        End of the transient at the beginning of a live run; None without one.
    handed_out
        The `stop` at which delayed results were published.
    judged
        Whether the signals of a live run were judged at its beginning.
    """

    def __init__(self, check: ChannelCheck, started: float, before: PreviousRun | None = None) -> None:
        self.check, self.groups = check, EventGroups()
        self._before = {} if before is None else before.counts
        self.responses = self.invalid = self.valid_lines = 0
        self.stop = self.handed_out = 0 if before is None else before.sample
        self.judged = False
        self.left_out_samples: int | None = None
        self.tracked_s = 0.0
        self._started = started

    @property
    def run_s(self) -> float:
        return time.perf_counter() - self._started

    def take(self, valid: NDArray[np.bool_], tracked_s: float) -> None:
        """Count the results of a step by where they are valid, and its processing time in seconds."""
        lines = int(np.count_nonzero(valid))
        self.responses += len(valid)
        if lines < valid.size:
            self.invalid += int(np.count_nonzero(~valid.all(axis=tuple(range(1, valid.ndim)))))
        self.valid_lines += lines
        self.tracked_s += tracked_s

    def judge(self) -> None:
        """From now the signals are judged."""
        self.judged = True

    def counts(self, tracker: Mapping[str, int]) -> dict[str, int]:
        """The tracker's counts in this run."""
        return {name: count - self._before.get(name, 0) for name, count in tracker.items()}

    _STATE = ("responses", "invalid", "valid_lines", "stop", "handed_out", "tracked_s")

    def snapshot(self) -> bytes:
        """State as bytes; see `restore`."""
        numbers = {name: getattr(self, name) for name in self._STATE}
        own = {"before": self._before, "judged": self.judged, "left_out_samples": self.left_out_samples}
        parts = {"check": self.check.snapshot(), "groups": self.groups.snapshot()}
        return encode(_STAGE, numbers | {"run_s": self.run_s} | own | parts)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot; StateError, and nothing has changed, if that cannot be restored."""
        state = decode(_STAGE, snapshot)
        restore_parts({"check": self.check, "groups": self.groups}, state)
        for name in self._STATE:
            setattr(self, name, state[name])
        self._started += self.run_s - state["run_s"]
        self.judged, self._before = state["judged"], state["before"]
        self.left_out_samples = state["left_out_samples"]
