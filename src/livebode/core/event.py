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
