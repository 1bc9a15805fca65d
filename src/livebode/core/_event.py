"""Event: something that a person should know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Event:
    """Something that a person should know, at one time of the recording.

    `kind` is a stable word that programs may rely on (``gap``, ``non-finite``, ``spike``, ``held``), `sample` the
    number of the first sample that it concerns, `time_s` its time in the source's clock, `message` one sentence for
    people, and `details` plain data.

    Examples
    --------
    >>> event = Event("gap", sample=4000, time_s=1.0, message="25 samples are missing", details={"missing": 25})
    >>> event.kind, event.details["missing"]
    ('gap', 25)
    """

    kind: str
    sample: int
    time_s: float
    message: str
    details: dict[str, Any] = field(default_factory=dict)


Emit = Callable[[Event], None]
"""Receives the events that a call finds, in their order."""


def ignore(event: Event) -> None:
    """The `Emit` of a caller who does not need events."""


def hand_over(events: list[Event], emit: Emit) -> None:
    """Emit the events in the order of their samples, and empty the list."""
    for event in sorted(events, key=lambda event: event.sample):
        emit(event)
    events.clear()
