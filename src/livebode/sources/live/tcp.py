"""TCP: consecutive frames from a sender that listens."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar

from livebode.core import LivebodeError
from livebode.sources.live.connection import pieces
from livebode.sources.live.fields import FieldDecoder, message_decoder
from livebode.sources.live.frame import FrameDecoder
from livebode.sources.live.framing import FrameSplitter
from livebode.sources.live.lines import LineSplitter
from livebode.sources.live.ndjson import LINE_BYTES_MAX
from livebode.sources.live.source import LiveSource

CONNECT_S = 5.0
DAMAGED_MAX = 16


class TcpSource(LiveSource):
    """Connects to the sender at host and port."""

    format: ClassVar[str] = "tcp"
    waits: ClassVar[bool] = True

    def _receive(self) -> bool:
        messages = message_decoder(self.settings)
        if isinstance(messages, FieldDecoder):
            return self._receive_messages(messages)
        decoder, splitter, skipped = FrameDecoder(), FrameSplitter(), 0
        with self._connected_link() as link:
            for piece in pieces(link, self._stop, "the sender"):
                for frame in splitter.feed(piece):
                    self._decode(decoder, frame)
                if splitter.skipped > skipped:
                    self._malformed(f"{splitter.skipped - skipped} bytes do not belong to a frame", piece)
                    skipped = splitter.skipped
                if splitter.damaged > DAMAGED_MAX:
                    raise ConnectionError("the sender sends only damaged frames")
        return False

    def _receive_messages(self, decoder: FieldDecoder) -> bool:
        """Lines of another program."""
        splitter = LineSplitter()
        with self._connected_link() as link:
            for piece in pieces(link, self._stop, "the sender"):
                for line in splitter.feed(piece):
                    self._decode(decoder, line)
                if splitter.cut:
                    self._malformed(f"{splitter.cut} lines were longer than {LINE_BYTES_MAX} bytes")
                    splitter.cut = 0
        return False

    @contextmanager
    def _connected_link(self) -> Iterator[socket.socket]:
        with socket.create_connection((self.address.host, self.address.port), CONNECT_S) as link:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._established()
            yield link

    def _decode(self, decoder: FrameDecoder | FieldDecoder, frame: bytes) -> None:
        try:
            batch = decoder.decode(frame)
        except LivebodeError as error:
            self._malformed(error, frame)
            return
        if batch is not None:
            self._deliver(batch)
