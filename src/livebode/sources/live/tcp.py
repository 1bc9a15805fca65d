"""TCP: consecutive frames from a sender that listens."""

from __future__ import annotations

import socket
from typing import ClassVar

from livebode.core import LivebodeError
from livebode.sources.live.frame import FrameDecoder
from livebode.sources.live.framing import FrameSplitter
from livebode.sources.live.source import TICK_S, LiveSource

PIECE_BYTES = 1 << 16
CONNECT_S = 5.0
SILENCE_S = 30.0
"""A connection without data for this time is closed: its sender may be gone without closing it."""
DAMAGED_MAX = 16


class TcpSource(LiveSource):
    """Connects to the sender at host and port."""

    format: ClassVar[str] = "tcp"

    def _receive(self) -> bool:
        decoder, splitter, skipped, silent_s = FrameDecoder(), FrameSplitter(), 0, 0.0
        with socket.create_connection((self.address.host, self.address.port), CONNECT_S) as link:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            link.settimeout(TICK_S)
            self._established()
            while not self._stop.is_set():
                try:
                    piece = link.recv(PIECE_BYTES)
                except TimeoutError:
                    silent_s += TICK_S
                    if silent_s > SILENCE_S:
                        raise ConnectionError(f"the sender sent nothing for {SILENCE_S:g} s") from None
                    continue
                if not piece:
                    raise ConnectionError("the sender closed the connection")
                silent_s = 0.0
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


SOURCE = TcpSource
