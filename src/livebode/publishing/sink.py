"""What a receiver implements, and how it fails."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Sequence
from typing import Protocol

from livebode.configuration import PublishSection
from livebode.core import PublishError
from livebode.plugins import loaded, named
from livebode.publishing.messages import AxisValues, EventMessage


def unreachable(error: Exception, timeout_s: float) -> PublishError:
    """The error of a receiver to which there is no connection, or that does not answer."""
    if isinstance(error, TimeoutError):
        return PublishError(
            "unreachable", f"no answer within {timeout_s:g} s", "check the receiver, or increase publish.timeout_s"
        )
    if isinstance(error, ssl.SSLError):
        why = getattr(error, "verify_message", "") or error.reason or "the connection was closed"
        return PublishError("unreachable", f"TLS failed: {why}", "check publish.ca_file and the receiver's certificate")
    if isinstance(error, socket.gaierror):
        return PublishError("unreachable", "its host name is not known", "check the host in publish.url")
    why = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return PublishError("unreachable", f"no connection: {why}", "check that the receiver runs, and publish.url")


def cannot_listen(host: str, port: int, error: OSError) -> PublishError:
    """The error that a server of ours has no port."""
    return PublishError(
        "cannot-listen",
        f"nothing can listen at {host} port {port}: {error.strerror}",
        "choose another port in publish.url, or end the program that uses it",
        port=port,
        errno=error.errno,
    )


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
