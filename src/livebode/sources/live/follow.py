"""Follow: a text table that grows, or a directory to which whole recordings are added."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, LivebodeError, SourceError
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.sources.delimited import DelimitedRecording
from livebode.sources.live.address import Address
from livebode.sources.live.batch import VALUES_MAX, Batch
from livebode.sources.live.followed import LINE_BYTES_MAX, FileLines, FileMark, FolderMark, checksum
from livebode.sources.live.position import Mark, Position
from livebode.sources.live.settings import SourceSettings
from livebode.sources.live.source import TICK_S, LiveSource
from livebode.sources.log import Log
from livebode.sources.opening import open_log
from livebode.sources.recording import Column, Recording
from livebode.sources.timing import find_time
from livebode.sources.units import SECONDS


@dataclass(frozen=True)
class TextTable:
    """A text table at its first inspection: how to read more of it."""

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
    A file that becomes shorter or is replaced is a restart, except if it begins with everything that was read before.
    """

    format: ClassVar[str] = "follow"
    waits: ClassVar[bool] = True
    on_demand: ClassVar[bool] = True
    paced: ClassVar[bool] = False

    def __init__(self, settings: SourceSettings, address: Address) -> None:
        super().__init__(settings, address)
        self._epoch, self._due = 1, -1
        self._mark: Mark = {}
        self._behind: tuple[str, int] | None = None

    def resume(self, position: Position) -> None:
        """Continue with the next sample in the file or directory."""
        super().resume(position)
        self._epoch, self._due = position.epoch, position.number
        self._mark = position.mark or self._mark
        self._sequencer.schema.rate_hz = self.settings.rate_hz or position.rate_hz

    def _receive(self) -> bool:
        path = Path(self.address.path)
        if path.is_dir():
            self._follow_directory(path)
            return False
        while not self._stop.is_set():
            table = self._looked_at(path)
            if table is not None:
                self._follow_file(path, table)
            self._stop.wait(TICK_S)
        return False

    def _looked_at(self, path: Path) -> TextTable | None:
        """The table, as soon as it has enough rows to detect its layout."""
        try:
            if not path.exists():
                raise SourceError("not-found", f"there is no file {path} yet", "check the name", path=str(path))
            log = open_log(
                path, rate_hz=self.settings.rate_hz or self._sequencer.schema.rate_hz, time=self.settings.time
            )
            return table_of(log, self.settings.time, path.stat().st_ino)
        except (LivebodeError, OSError) as error:
            self._trouble = error
            return None

    def _follow_file(self, path: Path, table: TextTable) -> None:
        """Batches of the present rows and of those that are added, until the file is replaced."""
        with path.open("rb") as file:
            begin, again = self._begin(path, file, table)
            self._announce(table.channels, table.rate_hz)
            lines = FileLines(file, begin, table.recording.encoding)
            self._established()
            while not self._stop.is_set():
                piece = lines.read(again)
                if piece is None:
                    if is_another(path, table.inode, file.tell()):
                        return
                    self._stop.wait(TICK_S)
                    continue
                if lines.cut:
                    self._malformed(Message("a line is longer than {bytes_max} bytes", bytes_max=LINE_BYTES_MAX))
                for batch in self._batches(table, piece.raw, piece.mark.rows, piece.mark.as_plain()):
                    if piece.mark.offset >= again or batch.stop > self._due:
                        self._deliver(batch)
                self._mark = piece.after.as_plain()

    def _begin(self, path: Path, file: BinaryIO, table: TextTable) -> tuple[FileMark, int]:
        """Where to begin to read, and the byte up to which the rows were already read."""
        start = FileMark.start(file, table.recording.offset)
        if not self._mark:
            return start, start.end
        mark = FileMark.of(self._mark)
        kept = mark.kept_in(file)
        if kept == "all":
            return mark, mark.end
        self._events.report("replaced", _replaced(path, kept, mark.end))
        if kept == "most":
            return mark, path.stat().st_size
        self._epoch, self._due = self._epoch + 1, -1
        return start, start.end

    def _batches(self, table: TextTable, lines: bytes, row: int, mark: Mark) -> Iterator[Batch]:
        """Batches of these lines; a line that does not fit the table is skipped."""
        if not lines.strip():
            return
        required = [*table.columns, *([table.time] if table.time else [])]
        try:
            values = table.recording.parsed(lines, required)
        except LivebodeError as error:
            middle = lines.rfind(b"\n", 0, max(len(lines) // 2, 1)) + 1 or lines.find(b"\n") + 1
            if middle >= len(lines):
                self._malformed(error)
                return
            yield from self._batches(table, lines[:middle], row, mark)
            yield from self._batches(table, lines[middle:], row + lines[:middle].count(b"\n"), mark)
            return
        numbers = row + np.arange(len(values[0]))
        if table.time is not None:
            time_s = np.asarray(values.pop(), dtype=np.float64) * table.scale_s
            usable = np.isfinite(time_s) & (time_s >= 0) & (time_s * table.rate_hz < 2**62)
            if not usable.all():
                self._malformed(Message("{rows} rows have no time", rows=np.count_nonzero(~usable)))
            numbers = np.rint(time_s[usable] * table.rate_hz).astype(np.int64)
            values = [column[usable] for column in values]
        yield from numbered(numbers, values, table.channels, table.rate_hz, self._epoch, mark)

    def _follow_directory(self, folder: Path) -> None:
        self._behind = self._behind or self._begin_folder(folder)
        self._established()
        while not self._stop.is_set():
            seen, counted = self._behind
            names = sorted(name for name in os.listdir(folder) if name > seen and not name.startswith("."))
            for at, name in enumerate(names):
                whole = self._segment(folder / name, seen, counted)
                # A file that cannot be read may still be incomplete, except if there is a later one.
                if whole is None and at == len(names) - 1:
                    break
                seen, counted = self._behind = name, counted if whole is None else whole
                self._due = -1
            self._stop.wait(TICK_S)

    def _begin_folder(self, folder: Path) -> tuple[str, int]:
        """Name after which to begin to read, and the number of rows up to there."""
        if not self._mark:
            return "", 0
        mark = FolderMark.of(self._mark)
        path = folder / mark.name
        if path.exists() and checksum(path) == mark.crc:
            return mark.seen, mark.counted  # its recorded rows are skipped
        due, self._due = self._due, -1
        whole = mark.last is not None and due >= mark.last
        if whole and not path.exists():
            return mark.name, mark.stop
        gone = Message("{path} was changed", path=path) if path.exists() else Message("{path} was removed", path=path)
        self._events.report(
            "replaced",
            Message(
                "{gone} since it was read up to sample {last_sample}; its other samples are not recorded",
                gone=gone,
                last_sample=due - 1,
            ),
        )
        self._epoch += not mark.timed
        return mark.name, max(mark.counted, mark.stop)

    def _segment(self, path: Path, seen: str, counted: int) -> int | None:
        """Deliver one recording whose rows are counted from `counted`; the count after it, None if unreadable."""
        try:
            given = self.settings
            rate_hz = given.rate_hz or self._sequencer.schema.rate_hz
            log = open_log(path, rate_hz=rate_hz, time=given.time, dbc=given.dbc).as_written()
            labels, mark = log.channels, FolderMark(path.name, checksum(path), seen, counted, log.timing is not None)
            self._announce(labels, log.rate_hz)
            held: Batch | None = None
            last = counted
            for block in log.blocks([channel.name for channel in labels], max(1, VALUES_MAX // len(labels))):
                first = counted + block.start
                if log.timing is not None:
                    first = round((block.origin_s + block.start / block.rate_hz) * block.rate_hz)
                self._pass_on(held)
                held = Batch(first, np.array(block.data), labels, block.rate_hz, self._epoch, mark=mark.as_plain())
                last = counted + block.stop
            if held is not None:
                self._pass_on(replace(held, mark=replace(mark, stop=last, last=held.stop).as_plain()))
        except (LivebodeError, OSError) as error:
            self._trouble = error
            return None
        return last

    def _pass_on(self, batch: Batch | None) -> None:
        """Deliver the recording if it is not recorded yet."""
        if batch is not None and batch.stop > self._due:
            self._deliver(batch)
            self._due = batch.stop


def _replaced(path: Path, kept: str, end_bytes: int) -> Message:
    """Of a file that was read up to a byte, by how much of that is unchanged."""
    if kept == "most":
        return Message(
            "{path} changed before byte {end_bytes}, up to which it was read: the changes are not recorded",
            path=path,
            end_bytes=end_bytes,
        )
    return Message(
        "{path} was truncated or replaced after it was read up to byte {end_bytes}. The new file is read from its "
        "beginning; what was added to the old one is not recorded",
        path=path,
        end_bytes=end_bytes,
    )


def table_of(log: Log, time: str | None, inode: int) -> TextTable:
    """How to continue reading the table of a log; SourceError if it is not a table."""
    recording: Recording = log._recording
    if not isinstance(recording, DelimitedRecording):
        raise SourceError(
            "cannot-grow",
            f"{log.path} is {log.format}, which cannot grow",
            "follow a directory of whole files instead",
            path=str(log.path),
            format=log.format,
        )
    column, _ = find_time(recording.columns, time)
    scale_s = 1.0
    if column is not None:
        scale_s = 1e-9 if column.temporal else SECONDS[log.timing.unit.casefold()] if log.timing else 1.0
    columns = tuple(c for c in recording.columns if not c.temporal)
    return TextTable(recording, columns, column, scale_s, log.rate_hz, inode)


def numbered(
    numbers: NDArray[np.int64], values: list[Any], channels: tuple[Channel, ...], rate_hz: float, epoch: int, mark: Mark
) -> Iterator[Batch]:
    """Batches of the samples with these numbers, each as long as they are consecutive and a batch may be."""
    cuts = np.flatnonzero(np.diff(numbers) != 1) + 1
    most = max(1, VALUES_MAX // len(channels))
    for first, last in zip([0, *cuts.tolist()], [*cuts.tolist(), len(numbers)]):
        for a in range(first, last, most):
            b = min(a + most, last)
            data = np.stack([np.asarray(column[a:b], dtype=np.float64) for column in values])
            yield Batch(int(numbers[a]), data, channels, rate_hz, epoch, mark=mark)


def is_another(path: Path, inode: int, read: int) -> bool:
    """Whether there is another file at `path`, or the same one is shorter than what was read of it."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return False  # it may be about to be replaced
    return found.st_ino != inode or found.st_size < read
