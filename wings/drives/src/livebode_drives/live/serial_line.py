"""Serial lines: a microcontroller at a serial port or at USB, with lines of numbers, lines of JSON or frames."""

from __future__ import annotations

import math
import os
import re
import time
from pathlib import Path
from types import ModuleType
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, ConfigError, LivebodeError, SourceError, not_installed
from livebode.sources.live import (
    LINE_BYTES_MAX,
    MAGIC,
    TICK_S,
    Address,
    AnyBatch,
    Batch,
    FrameDecoder,
    FrameSplitter,
    LineDecoder,
    LineSplitter,
    LiveSource,
    Position,
    Reach,
    named_channels,
)
from livebode_drives.live.arrival_rate import ArrivalRate
from livebode_drives.live.counter import Counter, NumberedSample, batches_of
from livebode_drives.source_settings import DriveKeys

_BETWEEN = re.compile(rb"[,;\s]+")
_SHOWN = 40


def numbers_in(line: bytes, width: int) -> NDArray[np.float64]:
    """The numbers in a line, separated by commas, semicolons, spaces or tabs.

    Raises
    ------
    SourceError
        Where the line has another number of fields, or one that is not a number.

    Examples
    --------
    >>> numbers_in(b"17, -0.5;1e3", 3).tolist()
    [17.0, -0.5, 1000.0]
    """
    fields = _BETWEEN.split(line.strip())
    if len(fields) != width:
        raise line_not_numbers(line, f"has {len(fields)} fields, not {width}")
    if b"_" in line:  # a digit separator in Python only
        raise line_not_numbers(line, "is not of numbers")
    try:
        return np.array([float(field) for field in fields])
    except ValueError:
        raise line_not_numbers(line, "is not of numbers") from None


def line_not_numbers(line: bytes, wrong: str) -> SourceError:
    shown = ascii(line[:_SHOWN].decode("latin-1"))
    return SourceError(
        "line-not-numbers",
        f"the line {shown} {wrong}",
        "send a number for each of source.channels in each line, and check source.baud_rate",
        line=shown,
    )


class NumberLines:
    """Turns lines of numbers into Batches.

    Without a counter each line is the next sample, also one that cannot be read: its sample is missing.

    Parameters
    ----------
    channels, rate_hz
        Of the stream.
    counter
        Number of the column that counts the samples; None without one.
    modulus
        Number of values of the counter; None if it does not wrap.
    epoch
        Of the first sample.
    """

    def __init__(
        self, channels: tuple[Channel, ...], rate_hz: float, counter: int | None, modulus: int | None, epoch: int
    ) -> None:
        self._channels, self._rate_hz, self._column = channels, rate_hz, counter
        self._counter = Counter(rate_hz, modulus, epoch)
        self._epoch, self._next = epoch, 0
        self.problems: list[object] = []
        """What was wrong with lines since this was cleared."""

    @property
    def epoch(self) -> int:
        """Epoch of the newest sample."""
        return self._epoch

    def restart(self) -> None:
        """The connection was lost: what is missing is known only to a counter."""
        if self._column is None:
            self._epoch, self._next = self._epoch + 1, 0

    def batches(self, lines: list[bytes], time_s: float) -> list[Batch]:
        """Batches of the samples in these lines, which arrived at `time_s`."""
        samples: list[NumberedSample] = []
        for line in lines:
            try:
                samples += self._sample(line, time_s)
            except SourceError as error:
                self.problems.append(error)
        if self._counter.damaged:
            self.problems.append(f"{self._counter.damaged} samples had a counter that no other sample confirmed")
            self._counter.damaged = 0
        if samples:
            self._epoch = samples[-1].epoch
        return batches_of(samples, self._channels, self._rate_hz, time_s)

    def _sample(self, line: bytes, time_s: float) -> list[NumberedSample]:
        self._next += 1
        row = numbers_in(line, len(self._channels))
        if self._column is None:
            return [NumberedSample(self._epoch, self._next - 1, row)]
        count = row[self._column]
        if not (math.isfinite(count) and count == math.floor(count) and 0 <= count < 1 << 53):
            raise line_not_numbers(line, f"has the counter {count:g}, which is not a whole number")
        return self._counter.process(int(count), time_s, row)


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
        first = min(index for index in (frame, line) if index >= 0)
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
        batches = []
        for frame in self._splitter.feed(piece):
            try:
                batch = self._decoder.decode(frame, time_s)
            except LivebodeError as error:
                self.problems.append(error)
                continue
            batches += [] if batch is None else [batch]
        if self._splitter.skipped > self._skipped:
            self.problems.append(f"{self._splitter.skipped - self._skipped} bytes do not belong to a frame")
            self._skipped = self._splitter.skipped
        return batches


class JsonDecoder:
    def __init__(self, rate_hz: float | None, problems: list[object]) -> None:
        self._splitter, self._decoder = LineSplitter(), LineDecoder(rate_hz)
        self.problems = problems

    def feed(self, piece: bytes, time_s: float) -> list[AnyBatch]:
        batches: list[AnyBatch] = []
        for line in self._splitter.feed(piece):
            try:
                batches.append(self._decoder.decode(line, time_s))
            except LivebodeError as error:
                self.problems.append(error)
        report_cut(self._splitter, self.problems)
        return batches


def report_cut(splitter: LineSplitter, problems: list[object]) -> None:
    if splitter.cut:
        problems.append(f"{splitter.cut} lines were longer than {LINE_BYTES_MAX} bytes")
        splitter.cut = 0


TOGETHER_S = 0.01
"""Time between reads: what arrives together costs less. The system's buffer holds 4 KiB, 40 ms of 921,600 baud."""
PIECE_BYTES = 1 << 16


class SerialSource(LiveSource):
    """The device at the port in the URL. The port is opened again after the device was unplugged."""

    settings: DriveKeys
    format: ClassVar[str] = "serial"

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        self._serial = import_serial()
        self._lines = number_lines(settings, 0) if settings.channels else None
        self._arrival: ArrivalRate | None = None
        self._epoch = 0

    def resume(self, position: Position) -> None:
        super().resume(position)
        if self._lines is not None:
            # Only a counter that does not wrap tells what is missing after a pause of any length.
            certain = self.settings.counter is not None and self.settings.counter_modulus is None
            self._lines = number_lines(self.settings, position.epoch + (not certain))

    def reach(self) -> Reach:
        """Whether the port is there; it is not opened, since that starts many devices again."""
        facts = {"address": str(self.address)}
        path = Path(self.address.path)
        if os.name != "nt" and not path.exists():
            from serial.tools.list_ports import comports

            devices = [port.device for port in comports()]
            remedy = (
                f"plug the device in, or set source.url to {' or '.join(devices)}" if devices else "plug the device in"
            )
            return Reach("failed", f"{self.address}: there is no such device", remedy, facts)
        if os.name != "nt" and not os.access(path, os.R_OK | os.W_OK):
            remedy = f"add the user to the group of {path}, often dialout, and log in again"
            return Reach("failed", f"{self.address}: permission denied", remedy, facts)
        return Reach("ok", f"{self.address} is there", facts=facts)

    def _receive(self) -> bool:
        # Another program that reads the port would take bytes from this one.
        with self._serial.Serial(self.address.path, self.settings.baud_rate, timeout=TICK_S, exclusive=True) as port:
            self._established()
            decoder, self._arrival = self._decoder(), None
            try:
                while not self._stop.is_set():
                    if piece := port.read(1):
                        self._process_piece(decoder, piece + port.read(min(port.in_waiting, PIECE_BYTES)))
                        self._stop.wait(TOGETHER_S)
            finally:
                if self._lines is not None:
                    self._lines.restart()
        return False

    def _decoder(self) -> SerialDecoder:
        return FramesOrJson(self.settings.rate_hz) if self._lines is None else NumbersDecoder(self._lines)

    def _process_piece(self, decoder: SerialDecoder, piece: bytes) -> None:
        now = time.monotonic()
        for batch in decoder.feed(piece, now):
            self._check_rate(batch, now)
            self._deliver(batch)
        for problem in decoder.problems:
            self._malformed(problem)
        decoder.problems.clear()

    def _check_rate(self, batch: AnyBatch, now: float) -> None:
        if self._arrival is None:
            self._arrival = ArrivalRate(self._events, batch.rate_hz)
        if batch.epoch != self._epoch:
            self._epoch = batch.epoch
            self._arrival.restart()
        self._arrival.add(batch.stop, now)


def number_lines(settings: DriveKeys, epoch: int) -> NumberLines:
    """The reader of lines of numbers for these settings; ConfigError if they are not complete."""
    if settings.rate_hz is None:
        raise ConfigError(
            "key-missing",
            "lines of numbers need source.rate_hz",
            "set it to the rate at which the device samples",
            key="source",
            keys=["rate_hz"],
        )
    channels = named_channels(settings.channels)
    names = [channel.name for channel in channels]
    if settings.counter is not None and settings.counter not in names:
        raise ConfigError(
            "value-invalid",
            f"source.counter = {settings.counter!r} is not one of source.channels",
            f"name one of {', '.join(names)}, or remove it",
            key="source.counter",
            value=settings.counter,
        )
    column = None if settings.counter is None else names.index(settings.counter)
    return NumberLines(channels, settings.rate_hz, column, settings.counter_modulus, epoch)


def import_serial() -> ModuleType:
    try:
        import serial
    except ImportError:
        raise not_installed(
            "serial needs the package pyserial, which is not installed", package="pyserial", extra="serial"
        ) from None
    return serial  # type: ignore[no-any-return]
