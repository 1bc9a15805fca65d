"""UDP: frames that anyone may send to a port of ours."""

from __future__ import annotations

import socket
from typing import ClassVar

from livebode.nouns import InputError
from livebode.sources.live.frame import FrameDecoder
from livebode.sources.live.source import TICK_S, LiveSource

_DATAGRAM_BYTES_MAX = 65535
_BUFFER_BYTES = 4 << 20


class UdpSource(LiveSource):
    """A frame in each datagram to the port of the URL; the host is the interface to listen on."""

    format: ClassVar[str] = "udp"
    reorders: ClassVar[bool] = True

    def _receive(self) -> bool:
        decoder = FrameDecoder()
        family = socket.AF_INET6 if ":" in self.address.host else socket.AF_INET
        with socket.socket(family, socket.SOCK_DGRAM) as port:
            port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            port.bind((self.address.host, self.address.port))
            port.settimeout(TICK_S)
            self._stands()
            while not self._stop.is_set():
                try:
                    datagram = port.recv(_DATAGRAM_BYTES_MAX)
                except TimeoutError:
                    continue
                try:
                    batch = decoder.decode(datagram)
                except InputError as error:
                    self._malformed(error)
                    continue
                if batch is not None:
                    self._deliver(batch)
        return False


SOURCE = UdpSource
