"""Event: something that a person should know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any

from livebode.dataclass import dataclass
from livebode.language import Message, recorded


@dataclass(frozen=True)
class Event:
    """Something that a person should know, at one time of the recording.

    `kind` is a stable word that programs may rely on (``gap``, ``non-finite``, ``spike``, ``held``), `sample` the
    number of the first sample that it concerns, `time_s` its time in the source's clock, `message` one English sentence
    for people, and `details` plain data. A `Message` adds its template and its facts to the details; from these,
    `words` is the message in any language.

    Examples
    --------
    >>> from livebode.language import Message
    >>> event = Event("gap", sample=4000, time_s=1.0, message=Message("{missing} samples are missing", missing=25))
    >>> event.kind, event.message, event.details
    ('gap', '25 samples are missing', {'template': '{missing} samples are missing', 'missing': 25})
    """

    kind: str
    sample: int
    time_s: float
    message: str
    details: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if isinstance(self.message, Message):
            object.__setattr__(self, "details", self.details | self.message.plain())
            object.__setattr__(self, "message", str(self.message))

    @property
    def words(self) -> str:
        """The message with its facts, for `livebode.language.worded`."""
        return recorded(self.details, self.message)


Emit = Callable[[Event], None]
"""Receives the events that a call finds, in their order."""


def ignore(event: Event) -> None:
    """The `Emit` of a caller who does not need events."""


def hand_over(events: list[Event], emit: Emit) -> None:
    """Emit the events in the order of their samples, and empty the list."""
    for event in sorted(events, key=lambda event: event.sample):
        emit(event)
    events.clear()
