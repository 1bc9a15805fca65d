"""The receiver: each event as one UDP datagram of JSON."""

import json
import socket
from collections.abc import Sequence

from livebode.configuration import PublishSection, check_url
from livebode.publishing import AxisValues, EventMessage


class DatagramSink:
    """Sends to the host and port of the section's URL."""

    events_at_once = 1
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        _, host, port, _ = check_url(section.url or "", section.kind)
        self._to = host, port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Send each event."""
        for event in events:
            self._socket.sendto(json.dumps(event.plain()).encode(), self._to)

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Results are not sent: `values` of this kind is empty."""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
