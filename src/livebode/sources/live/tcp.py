"""TCP: consecutive frames from a sender that listens."""

from __future__ import annotations

import socket
from typing import ClassVar

from livebode.core import LivebodeError
from livebode.sources.live.connection import pieces
from livebode.sources.live.frame import FrameDecoder
from livebode.sources.live.framing import FrameSplitter
from livebode.sources.live.source import LiveSource

CONNECT_S = 5.0
DAMAGED_MAX = 16


class TcpSource(LiveSource):
    """Connects to the sender at host and port."""

    format: ClassVar[str] = "tcp"
    waits: ClassVar[bool] = True

    def _receive(self) -> bool:
        decoder, splitter, skipped = FrameDecoder(), FrameSplitter(), 0
        with socket.create_connection((self.address.host, self.address.port), CONNECT_S) as link:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._established()
            for piece in pieces(link, self._stop, "the sender"):
                for frame in splitter.feed(piece):
                    self._decode(decoder, frame)
                if splitter.skipped > skipped:
                    self._malformed(f"{splitter.skipped - skipped} bytes do not belong to a frame")
                    skipped = splitter.skipped
                if splitter.damaged > DAMAGED_MAX:
                    raise ConnectionError("the sender sends only damaged frames")
        return False

    def _decode(self, decoder: FrameDecoder, frame: bytes) -> None:
        try:
            batch = decoder.decode(frame)
        except LivebodeError as error:
            self._malformed(error)
            return
        if batch is not None:
            self._deliver(batch)
