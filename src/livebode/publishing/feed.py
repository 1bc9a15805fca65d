"""AxisFeed: what an axis publishes, as messages for its receivers."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Protocol

from livebode.configuration import PublishSection
from livebode.core import Event, Parameters, Responses, RunClock
from livebode.monitoring import ALARMS, FAR, RETURNS, Priority, cause_of
from livebode.publishing.messages import (
    AlarmNow,
    AxisValues,
    Condition,
    EventMessage,
    measurements_of,
    response_of,
)
from livebode.runtime import ClockSet, Document, FitResults, RunControl, RunEnded, RunStarted, Status

SINK_KINDS = ("sink-down", "sink-up", "sink-full", "sink-refused")
"""Events about a receiver; they are not sent to this receiver itself."""
_AMOUNTS = {"amount_percent": "%", "missing": "samples"}
_ALARMS_MAX = 100


class Receiver(Protocol):
    """Takes events at once; it belongs to one [[publish]] section."""

    section: PublishSection

    def offer(self, event: EventMessage) -> None:
        """Take an event without waiting."""


class AxisFeed:
    """A subscriber of an axis: passes its events to the receivers, and keeps its newest results for them.

    A document costs some microseconds in the thread that tracks. `values` converts the results, in the thread of a
    receiver.

    Parameters
    ----------
    name
        Name of the axis.
    machine
        Path of the machine; empty: not specified.
    receivers
        Receivers of its events.
    """

    def __init__(self, name: str, machine: str, receivers: Sequence[Receiver] = ()) -> None:
        self.name, self.machine, self.receivers = name, machine, tuple(receivers)
        self.control: RunControl | None = None
        """Of the run that is tracked now."""
        self._status, self._clock, self._run = Status(), RunClock(), ""
        self._ended = False
        self._responses: Responses | None = None
        self._fits: tuple[Parameters, ...] = ()
        self._alarms: dict[str, AlarmNow] = {}

    def __call__(self, document: Document) -> None:
        self._status(document)
        match document:
            case Event():
                self._take(document)
            case Responses() if len(document):
                self._responses = document
            case FitResults(parts) if any(map(len, parts)):
                self._fits = parts
            case ClockSet(pieces):
                self._clock = RunClock(list(pieces))
            case RunStarted():
                self._begin(document.directory, document.summary, document.control)
            case RunEnded():
                self.control, self._ended = None, True

    def values(self) -> AxisValues | None:
        """The newest results; None before the first run."""
        if not self._run:
            return None
        responses, fits, status = self._responses, self._fits, self._status
        found: dict[str, float | str] = {"state": "done" if self._ended else status.state}
        found |= {"samples": status.samples, "responses": status.responses}
        numbers: dict[str, float | None] = {"rate_hz": status.rate_hz, "latency_s": status.latency_s}
        if (health := status.health) is not None:
            numbers |= {"lost": health.lost, "behind_s": health.waiting_s}
        found |= {name: value for name, value in numbers.items() if value is not None}
        time_s = None if responses is None else float(responses.time_s[-1])
        return AxisValues(
            self.name,
            self.machine,
            self._run,
            self._unix_s(time_s),
            measurements_of(fits),
            None if responses is None else response_of(responses),
            "" if responses is None else responses.quantity,
            "" if responses is None else responses.unit,
            found,
            tuple(self._alarms.copy().values()),
        )

    def message(self, event: Event) -> EventMessage:
        """The event as a message, with what it means for the active alarms."""
        cause, unix_s = cause_of(event), self._unix_s(event.time_s)
        condition: Condition = "event"
        priority: Priority | Literal["info"] = "info"
        if (alarm := ALARMS.get(event.kind)) is not None:
            condition, priority = "alarm", alarm.priority
            if event.kind == "change" and cause != FAR:
                self._alarms.pop(FAR, None)
            if alarm.end != "at once" and len(self._alarms) < _ALARMS_MAX:
                self._alarms[cause] = AlarmNow(cause, event.kind, alarm.priority, event.message, unix_s)
        elif event.kind in RETURNS and (active := self._alarms.pop(cause, None)) is not None:
            condition, priority = "ended", active.priority
        of = f"{self.machine}|{self.name}|{self._run}|{event.kind}|{event.sample}|{event.time_s}|{event.message}"
        value, unit = _amount(event.details)
        return EventMessage(
            hashlib.sha256(of.encode()).hexdigest()[:16],
            self.name,
            self.machine,
            self._run,
            event.kind,
            condition,
            priority,
            cause,
            event.message,
            unix_s,
            event.sample,
            value,
            unit,
        )

    def _take(self, event: Event) -> None:
        message = self.message(event)
        for receiver in self.receivers:
            section = receiver.section
            own = event.kind in SINK_KINDS and event.details.get("sink") == section.label
            if not own and wanted(message, section.sent_events):
                receiver.offer(message)

    def _begin(self, directory: Path, summary: Mapping[str, Any], control: RunControl) -> None:
        self._run, self.control, self._ended = directory.name, control, False
        self._clock = RunClock.of(dict(summary))
        self._responses, self._fits = None, ()
        self._alarms.clear()

    def _unix_s(self, time_s: float | None) -> float:
        """Seconds since 1970; the present where the run's clock is not known."""
        unix_s = None if time_s is None else self._clock.unix_s(time_s)
        return time.time() if unix_s is None or not 0 <= unix_s < 1e11 else unix_s


def wanted(message: EventMessage, events: Sequence[str]) -> bool:
    """Whether an event is one of these, as in `publish.events`."""
    named = {"all", message.priority} | ({"alarms"} if message.condition != "event" else set())
    return not named.isdisjoint(events)


def _amount(details: Mapping[str, Any]) -> tuple[float | None, str]:
    for name, unit in _AMOUNTS.items():
        value = details.get(name)
        if isinstance(value, int | float):
            return float(value), unit
    return None, ""
