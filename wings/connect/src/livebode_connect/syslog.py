"""SyslogSink: events as messages of RFC 5424, by UDP (RFC 5426), TCP (RFC 6587) or TLS (RFC 5425)."""

from __future__ import annotations

import socket
from collections.abc import Sequence

from livebode.publishing import AxisValues, EventMessage, PublishSection, address, client_tls, unreachable

_DAEMON = 3
"""Facility of RFC 5424: system daemons."""
_SEVERITIES = {"high": 2, "medium": 4, "low": 5, "info": 6}
_ENDED = 5
UDP_BYTES_MAX = 2048
"""Length that every receiver of RFC 5426 should take."""
_ENTERPRISE = 32473
"""Number for examples and documentation (RFC 5612), because livebode has none of its own."""


class SyslogSink:
    """A syslog server. By UDP nobody knows whether a message arrived; by TCP, once the system has sent it."""

    events_at_once = 100
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        self._section = section
        self._scheme, self._host, self._port, _ = address(section)
        self._context = client_tls(section) if self._scheme == "tls" else None
        self._name = socket.gethostname()
        self._socket: socket.socket | None = None

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Send each as one message."""
        messages = [rfc5424(event, self._name, self._section.template) for event in events]
        try:
            if self._socket is None:
                self._socket = self._connected()
            elif self._closed_by_peer(self._socket):
                self.close()
                self._socket = self._connected()
            for message in messages:
                if self._scheme == "udp":
                    self._socket.send(cut(message, UDP_BYTES_MAX))
                else:
                    self._socket.sendall(b"%d %s" % (len(message), message))
        except OSError as error:
            self.close()
            raise unreachable(error, self._section.timeout_s) from None

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Nothing: results are not sent by syslog."""

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _connected(self) -> socket.socket:
        where, timeout_s = (self._host, self._port), self._section.timeout_s
        if self._scheme == "udp":
            family, kind, protocol, _, address = socket.getaddrinfo(*where, type=socket.SOCK_DGRAM)[0]
            link = socket.socket(family, kind, protocol)
            link.settimeout(timeout_s)
            link.connect(address)
            return link
        link = socket.create_connection(where, timeout_s)
        return link if self._context is None else self._context.wrap_socket(link, server_hostname=self._host)

    def _closed_by_peer(self, link: socket.socket) -> bool:
        """Whether the server closed the connection: what is sent then is lost without an error."""
        if self._scheme == "udp":
            return False
        link.settimeout(0.0)
        try:
            return link.recv(1024) == b""
        except (BlockingIOError, OSError) as error:
            return not isinstance(error, BlockingIOError) and "want" not in type(error).__name__.lower()
        finally:
            link.settimeout(self._section.timeout_s)


def rfc5424(event: EventMessage, host: str, template: str | None) -> bytes:
    """The event as a message of RFC 5424, with its values as structured data.

    >>> event = EventMessage("ab", "x", "", "r", "gap", "alarm", "medium", "loss", "25 samples are missing", 0.0, 7)
    >>> rfc5424(event, "pc", None).decode("utf-8-sig").replace("\\ufeff", "")
    '<28>1 1970-01-01T00:00:00.000Z pc livebode - gap [livebode@32473 axis="x" condition="alarm" cause="loss" \
priority="medium" id="ab" sample="7"] x: 25 samples are missing'
    """
    severity = _ENDED if event.condition == "ended" else _SEVERITIES[event.priority]
    data = {"axis": event.axis, "condition": event.condition, "cause": event.cause, "priority": event.priority}
    data |= {"id": event.id, "sample": str(event.sample)}
    pairs = " ".join(f'{name}="{_escaped(value)}"' for name, value in data.items())
    head = f"<{8 * _DAEMON + severity}>1 {event.time} {_name(host, 255)} livebode - {_name(event.kind, 32)}"
    words = " ".join(event.sentence(template).splitlines())
    return f"{head} [livebode@{_ENTERPRISE} {pairs}] ".encode() + b"\xef\xbb\xbf" + words.encode()


def cut(message: bytes, length: int) -> bytes:
    """At most so many bytes, without a part of a letter at the end.

    >>> cut("aaä".encode(), 3)
    b'aa'
    """
    return message if len(message) <= length else message[:length].decode("utf-8", "ignore").encode()


def _escaped(value: str) -> str:
    r"""The value of a parameter: RFC 5424 escapes ", \ and ].

    >>> _escaped('a"]\\')
    'a\\"\\]\\\\'
    """
    return "".join(f"\\{letter}" if letter in '"\\]' else letter for letter in value)


def _name(text: str, length: int) -> str:
    """Printable ASCII without spaces, as RFC 5424 wants it in the header."""
    return "".join(letter for letter in text if 33 <= ord(letter) <= 126)[:length] or "-"
