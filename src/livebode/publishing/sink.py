"""SinkConnection: a receiver of events and results, as its kind implements it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from livebode.configuration import PublishSection
from livebode.plugins import loaded, named
from livebode.publishing.messages import AxisValues, EventMessage


class SinkConnection(Protocol):
    """A receiver; used by one thread only. Its constructor takes the section, and does not connect.

    The constructor raises ConfigError for what the section names and cannot be used, such as a file, and ExtraError
    for a package that is missing. The methods raise PublishError "unreachable" or "refused" if the same message has to
    be sent again later, and "not-taken" if it must not.
    """

    events_at_once: int
    """Most events of one call of `send_events`."""
    pause_s: float
    """Time after a message in which events are collected for the next one."""

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Send these; returns when the receiver has them."""

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Send the newest results of these axes."""

    def close(self) -> None:
        """Close the connection."""


def open_sink(section: PublishSection) -> SinkConnection:
    """The sink of a section; see `SinkConnection` for what it raises."""
    sink: SinkConnection = loaded(named("sinks")[section.kind].sink)(section)
    return sink
