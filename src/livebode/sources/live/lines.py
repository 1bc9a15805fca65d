"""Standard input: batches as NDJSON from a program that writes to a pipe."""

from __future__ import annotations

import os
import select
import sys
from queue import Empty, Queue
from threading import Thread
from typing import ClassVar

from livebode.core import LivebodeError
from livebode.sources.live.fields import FieldDecoder, message_decoder
from livebode.sources.live.ndjson import LINE_BYTES_MAX, LineDecoder
from livebode.sources.live.reach import Reach
from livebode.sources.live.source import TICK_S, LiveSource

_PIECE_BYTES = 1 << 13  # bytes that were read but not recorded are lost when the process is killed


class StdinSource(LiveSource):
    """Lines of JSON on standard input; ends with it, and blocks a writer that is too fast."""

    format: ClassVar[str] = "ndjson"
    waits: ClassVar[bool] = True
    on_demand: ClassVar[bool] = True

    def reach(self) -> Reach:
        return Reach("not applicable", "samples come from standard input")

    def _receive(self) -> bool:
        decoder, splitter = message_decoder(self.settings), LineSplitter()
        number = sys.stdin.fileno()
        self._established()
        pieces = _Pieces(number)
        while not self._stop.is_set():
            if (piece := pieces.next()) is None:
                continue
            for line in splitter.feed(piece):
                self._decode(decoder, line)
            if splitter.cut:
                self._malformed(f"{splitter.cut} lines were longer than {LINE_BYTES_MAX} bytes")
                splitter.cut = 0
            if not piece:
                return True
        return False

    def _decode(self, decoder: LineDecoder | FieldDecoder, line: bytes) -> None:
        try:
            batch = decoder.decode(line)
        except LivebodeError as error:
            self._malformed(error, line)
            return
        self._deliver(batch)


class _Pieces:
    """What comes from a pipe; a thread waits for it where `select` knows sockets only, as on Windows."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._read: Queue[bytes] | None = None
        try:
            select.select([number], [], [], 0)
        except OSError:
            self._read = Queue(1)
            Thread(target=self._wait, name="livebode-stdin", daemon=True).start()

    def next(self) -> bytes | None:
        """The next bytes, none at the end; None if nothing has come for a while."""
        if self._read is None:
            ready = select.select([self._number], [], [], TICK_S)[0]
            return os.read(self._number, _PIECE_BYTES) if ready else None
        try:
            return self._read.get(timeout=TICK_S)
        except Empty:
            return None

    def _wait(self) -> None:
        assert self._read is not None
        piece = b" "
        while piece:
            piece = os.read(self._number, _PIECE_BYTES)
            self._read.put(piece)


class LineSplitter:
    r"""Cuts a stream of bytes into lines; a line that is too long is skipped, so that memory is bounded.

    >>> splitter = LineSplitter()
    >>> splitter.feed(b"a\nb"), splitter.feed(b"c\n\n"), splitter.feed(b"")
    ([b'a'], [b'bc'], [])
    """

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self.cut = 0
        """Number of lines that were too long."""

    def feed(self, piece: bytes) -> list[bytes]:
        """Lines completed by `piece`, without empty ones; an empty piece is the end and completes the last line."""
        *ends, rest = piece.split(b"\n")
        lines = []
        for end in ends:
            self._add(end)
            lines += self._line()
        self._add(rest)
        return lines if piece else self._line()

    def _add(self, part: bytes) -> None:
        self._size += len(part)
        if self._size <= LINE_BYTES_MAX:
            self._parts.append(part)
        else:
            self._parts.clear()

    def _line(self) -> list[bytes]:
        self.cut += self._size > LINE_BYTES_MAX
        line = b"".join(self._parts).strip() if self._size <= LINE_BYTES_MAX else b""
        self._parts, self._size = [], 0
        return [line] if line else []
