"""What a serial line carries: lines of numbers where channels are given, otherwise frames or lines of JSON."""

from __future__ import annotations

from typing import Protocol

from livebode.core import LivebodeError
from livebode.sources.live import (
    LINE_BYTES_MAX,
    MAGIC,
    AnyBatch,
    FrameDecoder,
    FrameSplitter,
    LineDecoder,
    LineSplitter,
)
from livebode_drives.live.number_lines import NumberLines

UNKNOWN_BYTES = 1 << 12
"""Bytes without a frame or JSON that are searched, and reported together."""


class SerialDecoder(Protocol):
    """Turns the bytes of one connection into batches."""

    problems: list[object]
    """What was wrong with the bytes since this was cleared."""

    def feed(self, piece: bytes, time_s: float) -> list[AnyBatch]:
        """The batches that are complete with these bytes, which arrived at `time_s`."""
        ...


class NumbersDecoder:
    """Lines of numbers. What comes before the first end of a line may be a part of a line, and is dropped."""

    def __init__(self, lines: NumberLines) -> None:
        self._lines, self._splitter, self._begun = lines, LineSplitter(), False
        self.problems = lines.problems

    def feed(self, piece: bytes, time_s: float) -> list[AnyBatch]:
        if not self._begun:
            _, end, piece = piece.partition(b"\n")
            self._begun = bool(end)
        if not piece:
            return []
        batches: list[AnyBatch] = [*self._lines.batches(self._splitter.feed(piece), time_s)]
        report_cut(self._splitter, self.problems)
        return batches


class FramesOrJson:
    """Frames or lines of JSON, whichever comes first."""

    def __init__(self, rate_hz: float | None) -> None:
        self._rate_hz, self._start = rate_hz, bytearray()
        self._decoder: FramesDecoder | JsonDecoder | None = None
        self.problems: list[object] = []

    def feed(self, piece: bytes, time_s: float) -> list[AnyBatch]:
        if self._decoder is None:
            self._start += piece
            piece = self._recognized()
        return [] if self._decoder is None else self._decoder.feed(piece, time_s)

    def _recognized(self) -> bytes:
        """The bytes from the first frame or object on, and its decoder; none while there is none."""
        frame, line = self._start.find(MAGIC), self._start.find(b"\n{")
        if frame < 0 and line < 0:
            if len(self._start) >= UNKNOWN_BYTES:
                self.problems.append(
                    f"{len(self._start)} bytes contain neither a frame nor a line of JSON; check source.baud_rate, and "
                    "for lines of numbers set source.channels"
                )
                self._start = self._start[1 - len(MAGIC) :]
            return b""
        first = min(at for at in (frame, line) if at >= 0)
        if first == frame:
            self._decoder = FramesDecoder(self.problems)
        else:
            self._decoder = JsonDecoder(self._rate_hz, self.problems)
        return bytes(self._start[first:])


class FramesDecoder:
    def __init__(self, problems: list[object]) -> None:
        self._splitter, self._decoder, self._skipped = FrameSplitter(), FrameDecoder(), 0
        self.problems = problems

    def feed(self, piece: bytes, time_s: float) -> list[AnyBatch]:
        found = []
        for frame in self._splitter.feed(piece):
            try:
                batch = self._decoder.decode(frame, time_s)
            except LivebodeError as error:
                self.problems.append(error)
                continue
            found += [] if batch is None else [batch]
        if self._splitter.skipped > self._skipped:
            self.problems.append(f"{self._splitter.skipped - self._skipped} bytes do not belong to a frame")
            self._skipped = self._splitter.skipped
        return found


class JsonDecoder:
    def __init__(self, rate_hz: float | None, problems: list[object]) -> None:
        self._splitter, self._decoder = LineSplitter(), LineDecoder(rate_hz)
        self.problems = problems

    def feed(self, piece: bytes, time_s: float) -> list[AnyBatch]:
        found: list[AnyBatch] = []
        for line in self._splitter.feed(piece):
            try:
                found.append(self._decoder.decode(line, time_s))
            except LivebodeError as error:
                self.problems.append(error)
        report_cut(self._splitter, self.problems)
        return found


def report_cut(splitter: LineSplitter, problems: list[object]) -> None:
    if splitter.cut:
        problems.append(f"{splitter.cut} lines were longer than {LINE_BYTES_MAX} bytes")
        splitter.cut = 0
