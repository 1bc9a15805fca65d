"""The events that a call finds, beside its result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from livebode.core import Event


def with_events(call: Callable[..., Any], *given: object) -> tuple[Any, list[Event]]:
    """What `call` returns for these arguments, and the events that it emits."""
    events: list[Event] = []
    return call(*given, events.append), events
