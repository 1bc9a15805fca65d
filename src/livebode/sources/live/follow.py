"""Follow: a table in text that grows, or a directory to which whole recordings are added."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import Channel, InputError
from livebode.sources.delimited import DelimitedRecording
from livebode.sources.live.batch import VALUES_MAX, Batch
from livebode.sources.live.source import TICK_S, LiveSource
from livebode.sources.log import Log
from livebode.sources.opening import open_log
from livebode.sources.recording import Column, Recording
from livebode.sources.timing import find_time
from livebode.sources.units import SECONDS

PIECE_BYTES = 1 << 19
LINE_BYTES_MAX = 1 << 20


@dataclass(frozen=True)
class Table:
    """A table in text as it stood when it was first looked at: how to read more of it."""

    recording: DelimitedRecording
    columns: tuple[Column, ...]
    time: Column | None
    scale_s: float
    rate_hz: float
    inode: int

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(Channel(column.name, column.unit) for column in self.columns)


class FollowSource(LiveSource):
    """A file of rows that is appended to, or a directory whose files are read in the order of their names.

    The time column numbers the samples, so that missing rows are gaps; without one (`rate_hz` given) rows are counted.
    A file that becomes shorter or is replaced is a restart.
    """

    format: ClassVar[str] = "follow"
    waits: ClassVar[bool] = True

    def _receive(self) -> bool:
        assert self.settings.log is not None
        path = self.settings.log
        if path.is_dir():
            self._follow_directory(path)
            return False
        epoch = 0
        while not self._stop.is_set():
            table = self._looked_at(path)
            if table is not None:
                epoch += 1
                self._follow_file(path, table, epoch)
            self._stop.wait(TICK_S)
        return False

    def _looked_at(self, path: Path) -> Table | None:
        """The table, once it has enough rows to tell what is in it."""
        try:
            if not path.exists():
                raise InputError(f"there is no file {path} yet")
            log = open_log(path, rate_hz=self.settings.rate_hz or self._sequencer.face.rate_hz, time=self.settings.time)
            return table_of(log, self.settings.time, path.stat().st_ino)
        except (InputError, OSError) as error:
            self._trouble = str(error)
            return None

    def _follow_file(self, path: Path, table: Table, epoch: int) -> None:
        """Batches of what stands there and of what is added, until the file is another one."""
        rows, kept = 0, b""
        with path.open("rb") as file:
            file.seek(table.recording.offset)
            self._stands()
            while not self._stop.is_set():
                piece = file.read(PIECE_BYTES)
                if not piece:
                    if is_another(path, table.inode, file.tell()):
                        return
                    self._stop.wait(TICK_S)
                    continue
                lines, kept = whole_lines(kept + piece, table.recording.encoding)
                if len(kept) > LINE_BYTES_MAX:
                    self._malformed(f"a line is longer than {LINE_BYTES_MAX} bytes")
                    kept = b""
                for batch in self._batches(table, lines, rows, epoch):
                    self._deliver(batch)
                rows += lines.count(b"\n")

    def _batches(self, table: Table, lines: bytes, row: int, epoch: int) -> Iterator[Batch]:
        """Batches of these lines; a line that does not fit the table is left out."""
        if not lines.strip():
            return
        wanted = [*table.columns, *([table.time] if table.time else [])]
        try:
            values = table.recording.parsed(lines, wanted)
        except InputError as error:
            middle = lines.rfind(b"\n", 0, max(len(lines) // 2, 1)) + 1 or lines.find(b"\n") + 1
            if middle >= len(lines):
                self._malformed(error)
                return
            yield from self._batches(table, lines[:middle], row, epoch)
            yield from self._batches(table, lines[middle:], row + lines[:middle].count(b"\n"), epoch)
            return
        numbers = row + np.arange(len(values[0]))
        if table.time is not None:
            time_s = np.asarray(values.pop(), dtype=np.float64) * table.scale_s
            usable = np.isfinite(time_s) & (time_s >= 0) & (time_s * table.rate_hz < 2**62)
            if not usable.all():
                self._malformed(f"{np.count_nonzero(~usable)} rows have no time")
            numbers = np.rint(time_s[usable] * table.rate_hz).astype(np.int64)
            values = [column[usable] for column in values]
        yield from numbered(numbers, values, table.channels, table.rate_hz, epoch)

    def _follow_directory(self, folder: Path) -> None:
        seen, counted = "", 0
        self._stands()
        while not self._stop.is_set():
            names = sorted(name for name in os.listdir(folder) if name > seen and not name.startswith("."))
            for at, name in enumerate(names):
                whole = self._segment(folder / name, counted)
                # A file that cannot be read may still be written, unless a later one is there.
                if whole is None and at == len(names) - 1:
                    break
                seen, counted = name, counted if whole is None else whole
            self._stop.wait(TICK_S)

    def _segment(self, path: Path, counted: int) -> int | None:
        """Deliver one recording whose rows are counted from `counted` on; the count behind it, None if unreadable."""
        try:
            log = open_log(path, rate_hz=self.settings.rate_hz or self._sequencer.face.rate_hz, time=self.settings.time)
            labels = log.channels
            for block in log.blocks([channel.name for channel in labels], max(1, VALUES_MAX // len(labels))):
                first = counted + block.start
                if log.timing is not None:
                    first = round((block.origin_s + block.start / block.rate_hz) * block.rate_hz)
                self._deliver(Batch(first, np.array(block.data), labels, block.rate_hz))
                last = counted + block.stop
        except (InputError, OSError) as error:
            self._trouble = str(error)
            return None
        return last


def table_of(log: Log, time: str | None, inode: int) -> Table:
    """How to go on reading the table that a log is of; InputError where it is none."""
    recording: Recording = log._recording
    if not isinstance(recording, DelimitedRecording):
        raise InputError(f"{log.path} is {log.format}, which cannot grow; follow a directory of whole files instead")
    column, _ = find_time(recording.columns, time)
    scale_s = 1.0
    if column is not None:
        scale_s = 1e-9 if column.temporal else SECONDS[log.timing.unit.casefold()] if log.timing else 1.0
    columns = tuple(c for c in recording.columns if not c.temporal)
    return Table(recording, columns, column, scale_s, log.rate_hz, inode)


def numbered(
    numbers: NDArray[np.int64], values: list[Any], channels: tuple[Channel, ...], rate_hz: float, epoch: int
) -> Iterator[Batch]:
    """Batches of the samples with these numbers, each as long as they follow each other and a batch may be."""
    cuts = np.flatnonzero(np.diff(numbers) != 1) + 1
    most = max(1, VALUES_MAX // len(channels))
    for first, last in zip([0, *cuts.tolist()], [*cuts.tolist(), len(numbers)]):
        for a in range(first, last, most):
            b = min(a + most, last)
            data = np.stack([np.asarray(column[a:b], dtype=np.float64) for column in values])
            yield Batch(int(numbers[a]), data, channels, rate_hz, epoch)


def whole_lines(raw: bytes, encoding: str) -> tuple[bytes, bytes]:
    r"""The lines that have ended, and the beginning of the next.

    >>> whole_lines(b"1,2\n3,4\n5", "utf-8")
    (b'1,2\n3,4\n', b'5')
    """
    end = {"utf-16-le": b"\n\0", "utf-16-be": b"\0\n"}.get(encoding, b"\n")
    at = raw.rfind(end)
    at = at + len(end) if at >= 0 else 0
    return raw[:at], raw[at:]


def is_another(path: Path, inode: int, read: int) -> bool:
    """Whether another file stands at `path`, or the same one is shorter than what was read of it."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return False  # it may be about to be replaced
    return found.st_ino != inode or found.st_size < read
