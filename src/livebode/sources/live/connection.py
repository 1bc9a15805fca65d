"""What a stream socket sends, until it is silent for too long."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from threading import Event

from livebode.sources.live.source import TICK_S

SILENCE_S = 30.0
"""A connection without data for this time is closed: its sender may be gone without closing it."""
_PIECE_BYTES = 1 << 16


def pieces(link: socket.socket, stop: Event, sender: str) -> Iterator[bytes]:
    """Bytes as they come, until `stop` is set; ConnectionError, with the name of the sender, when there are no more."""
    link.settimeout(TICK_S)
    silent_s = 0.0
    while not stop.is_set():
        try:
            piece = link.recv(_PIECE_BYTES)
        except TimeoutError:
            silent_s += TICK_S
            if silent_s > SILENCE_S:
                raise ConnectionError(f"{sender} sent nothing for {SILENCE_S:g} s") from None
            continue
        if not piece:
            raise ConnectionError(f"{sender} closed the connection")
        silent_s = 0.0
        yield piece
