"""Events of a run and results of its monitoring, as a report shows them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import field
from typing import Any

from livebode.core import Event, Finding, Paragraph, Part, PrintedTable, moment
from livebode.dataclass import dataclass
from livebode.language import number, recorded, tr, trn, worded
from livebode.monitoring import UNMONITORED, result_tone
from livebode.records import RunRecord, each_event, event_counts

ALARMS = (
    "change", "change-corrected", "change-cleared", "baseline-unknown", "doubtful", *UNMONITORED,
    "places-not-monitored",
)  # fmt: skip
"""Kinds that are listed individually; so are the events of the record itself."""
_IN_FULL = 20  # of the first and of the newest events, each


@dataclass
class EventsOfKind:
    """The first and the newest event of a kind, and their number."""

    first: Event
    newest: Event
    count: int = 0


@dataclass
class EventSummary:
    """Events by kind, and the first and the newest of those that are listed individually."""

    kinds: dict[str, EventsOfKind] = field(default_factory=dict)
    early: list[Event] = field(default_factory=list)
    late: deque[Event] = field(default_factory=lambda: deque(maxlen=_IN_FULL))
    reported: int = 0

    @classmethod
    def of(cls, events: Iterable[Event]) -> EventSummary:
        summary = cls()
        for event in events:
            for single in each_event(event):
                summary._add(single)
            for kind, count in event_counts(event).items():
                summary.kinds.setdefault(kind, EventsOfKind(event, event)).count += count
        return summary

    def _add(self, event: Event) -> None:
        kind = self.kinds.setdefault(event.kind, EventsOfKind(event, event))
        kind.newest = event
        if event.kind not in ALARMS and not event.kind.startswith("record-"):
            return
        self.reported += 1
        (self.early if len(self.early) < _IN_FULL else self.late).append(event)

    def count(self, kind: str) -> int:
        """Number of events of this kind."""
        return self.kinds[kind].count if kind in self.kinds else 0

    @property
    def in_full(self) -> list[Event]:
        """The first and the newest alarms and events of the record, in their order."""
        return [*self.early, *self.late]

    @property
    def left_out(self) -> int:
        """Number of events between the first and the newest that are not retained."""
        return self.reported - len(self.early) - len(self.late)

    def parts(self) -> tuple[Part, ...]:
        """A table of the kinds, and a list of the alarms."""
        if not self.kinds:
            return (Paragraph(tr("The run has no events.")),)
        rows = tuple(
            (
                worded(name), number(k.count, ","), moment(k.first.time_s, 2), moment(k.newest.time_s, 2),
                worded(k.newest.words),
            )
            for name, k in self.kinds.items()
        )  # fmt: skip
        headings = (tr("kind"), tr("count"), tr("first"), tr("newest"), tr("newest message"))
        grouped = PrintedTable(headings, rows, (1,))
        if not self.reported:
            return (grouped,)
        note = trn(
            "{n:,} event between them not shown; events.jsonl contains all.",
            "{n:,} events between them not shown; events.jsonl contains all.",
            self.left_out,
        )
        in_full = tuple((moment(e.time_s, 2), worded(e.kind), worded(e.words)) for e in self.in_full)
        return grouped, PrintedTable(
            (tr("time"), tr("kind"), tr("message")), in_full, note=note if self.left_out else ""
        )


_ACTIVE_MAX = 5


def alarms(run: RunRecord, event_summary: EventSummary) -> tuple[Finding, ...]:
    """The summary of the monitoring, then the active alarms."""
    monitoring: dict[str, Any] = run.summary.get("monitoring", {})
    if "message" not in monitoring or (run.ended and monitoring.get("baseline") is None):
        return (_so_far(run, event_summary),)
    active = bool(monitoring.get("standing"))
    tone = result_tone(monitoring, active=active)
    latest = _newest(event_summary)[-_ACTIVE_MAX:] if active else []
    return (
        Finding(tone, worded(recorded(monitoring.get("words", {}), monitoring["message"]))),
        *(Finding("alarm", worded(event.words)) for event in latest),
    )


def _newest(event_summary: EventSummary) -> list[Event]:
    """The newest report of each change that has not cleared."""
    newest: dict[tuple[str, str], Event] = {}
    for event in event_summary.in_full:
        key = str(event.details.get("what")), str(event.details.get("place_m"))
        if event.kind in ("change", "change-corrected"):
            newest[key] = event
        elif event.kind == "change-cleared":
            newest.pop(key, None)
    return list(newest.values())


def _so_far(run: RunRecord, event_summary: EventSummary) -> Finding:
    """The changes so far, if run.json does not contain a summary yet."""
    if run.ended:
        return Finding(
            "open", tr("Changes are not assessed: the run was not compared with a baseline of the healthy machine.")
        )
    came, cleared = event_summary.count("change"), event_summary.count("change-cleared")
    if not came:
        text = tr("No change was reported so far; the final verdict is available at the end of the run.")
        return Finding("open", text)
    message = trn(
        "So far {n:,} change reported, {cleared} cleared.", "So far {n:,} changes reported, {cleared} cleared.", came,
        cleared=cleared,
    )  # fmt: skip
    return Finding("alarm" if came > cleared else "check", message)
