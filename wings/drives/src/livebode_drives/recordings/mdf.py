"""MDF 4 and 3, the file of measurement systems in vehicles: channel groups, and CAN frames, streamed by asammdf.

asammdf is opened without its messages and without what it leaves behind after an error.
"""

from __future__ import annotations

import heapq
import logging
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from livebode.sources import (
    COLUMNS_MAX,
    Chunk,
    Column,
    Recording,
    Skipped,
    damaged,
    missing,
    no_frames,
    oversized,
    truncated,
)
from livebode_drives.recordings.can import CanRecording, Identity
from livebode_drives.recordings.silence import silence


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    try:
        from asammdf import MDF, mdf
        from asammdf.blocks import mdf_v3, mdf_v4, v4_blocks
    except ImportError:
        raise missing(path, "asammdf", "mdf") from None
    silence(mdf, mdf_v3, mdf_v4, v4_blocks)
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # its messages are in the error that follows
    with path.open("rb") as raw:  # a path would be mapped; if a mapped file shrinks, the process is killed
        try:
            file = MDF(raw)
        except Exception as error:
            abandon(error)
            raise
        try:
            yield file
        finally:
            file.close()


def abandon(error: Exception) -> None:
    """Close the incomplete object of asammdf, which would print on standard error when it is collected."""
    trace = error.__traceback__
    while trace is not None:
        half: Any = trace.tb_frame.f_locals.get("self")
        if hasattr(half, "_tempfile") and not getattr(half, "_closed", True):
            half._closed = True
            half._tempfile.close()
        trace = trace.tb_next


FRAME = "CAN_DataFrame"
ROWS = 1000
EXTENDED = 1 << 31


class MdfCanRecording(CanRecording):
    """The CAN frames of an MDF file; see CanRecording. Its other channels are read without a DBC."""

    format: ClassVar[str] = "mdf"

    def _frames(self) -> Iterator[tuple[Identity, float, bytes]]:
        with opened(self.path) as file:
            groups = [
                group_frames(file, number, int(group.channel_group.cycles_nr))
                for number, group in enumerate(file.groups)
                if any(channel.name == FRAME for channel in group.channels)
            ]
            yield from heapq.merge(*groups, key=lambda frame: frame[1])


def group_frames(file: Any, group: int, samples: int) -> Iterator[tuple[Identity, float, bytes]]:
    for first in range(0, samples, ROWS):
        count = min(ROWS, samples - first)
        frames = file.get(FRAME, group, record_offset=first, record_count=count, ignore_invalidation_bits=True)
        if len(frames.samples) != count:
            raise truncated(f"group {group} ends before its {samples} frames", samples=samples)
        fields = {name.rpartition(".")[2]: frames.samples[name] for name in frames.samples.dtype.names}
        numbers = np.asarray(fields["ID"], dtype=np.int64)
        extended = np.asarray(fields.get("IDE", 0), dtype=bool) | (numbers & EXTENDED > 0)
        buses = np.broadcast_to(fields.get("BusChannel", np.int64(1)), count)
        lengths = np.asarray(fields.get("DataLength", fields.get("DLC")), dtype=np.int64)
        for row in range(count):
            identity = int(buses[row]), int(numbers[row]) & 0x1FFFFFFF, bool(extended[row])
            yield identity, float(frames.timestamps[row]), fields["DataBytes"][row][: lengths[row]].tobytes()


TIME_MASTER = 1
_COMPARED = 64  # samples of a time
FRAMES = "CAN_DataFrame", "CAN_ErrorFrame", "CAN_RemoteFrame"


class MdfRecording(Recording):
    """An MDF file. A channel goes by its name, or by group/name (groups from 0) if several groups have the name.

    Each group has its own time: groups with the same times belong together, others have clocks of their own. Values
    are physical; a sample that the file marks as invalid is NaN.
    """

    format: ClassVar[str] = "mdf"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.has_frames = False
        columns: list[Column] = []
        skipped: list[Skipped] = []
        clocks: dict[int, bytes] = {}
        with opened(path) as file:
            for number, group in enumerate(file.groups):
                if len(columns) + len(group.channels) > COLUMNS_MAX:
                    raise oversized(f"{path} has more than {COLUMNS_MAX} channels", COLUMNS_MAX, path=str(path))
                samples = int(group.channel_group.cycles_nr)
                self._check_size(file, number, samples)
                for channel in group.channels:
                    self._check_place(channel, int(group.channel_group.samples_byte_nr))
                if any(channel.name in FRAMES for channel in group.channels):
                    self.has_frames = True
                    skipped.append(
                        Skipped(f"group {number}", "it has CAN frames, whose signals only a DBC file defines")
                    )
                    continue
                for index, channel in enumerate(group.channels):
                    column = Column(channel.name, unit_of(channel), samples, key=(number, index))
                    first = file.get(group=number, index=index, record_count=1, ignore_invalidation_bits=True)
                    if first.samples.ndim == 1 and first.samples.dtype.kind in "fiub":
                        columns.append(replace(column, unit=str(first.unit or column.unit)))
                    else:
                        skipped.append(Skipped(channel.name, "its values are not single numbers"))
                clocks[number] = clock_of(file, number, samples)
        count = Counter(column.name for column in columns)
        named = [
            replace(column, name=f"{column.key[0]}/{column.name}") if count[column.name] > 1 else column
            for column in columns
        ]
        self.columns, self.skipped = grouped(named, clocks), tuple(skipped)

    def _check_size(self, file: Any, number: int, samples: int) -> None:
        """RecordingError if a group declares more than the file can contain, even compressed by 1000."""
        width = int(file.groups[number].channel_group.samples_byte_nr)
        if samples * max(width, 1) > 1000 * self.path.stat().st_size:
            raise truncated(
                f"{self.path} declares {samples} samples of {width} bytes, more than its size allows",
                path=str(self.path),
                samples=samples,
            )

    def _check_place(self, channel: Any, record_bytes: int) -> None:
        """RecordingError if a channel is outside its record: asammdf would read the memory behind it."""
        if hasattr(channel, "byte_offset"):
            end = 8 * channel.byte_offset + channel.bit_offset + channel.bit_count
        else:
            end = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0) + channel.bit_count
        if end > 8 * record_bytes:
            raise damaged(
                f"{self.path}: channel {channel.name!r} ends at bit {end} of {record_bytes} bytes",
                path=str(self.path),
                channel=str(channel.name),
            )

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        samples = columns[0].samples or 0
        with opened(self.path) as file:
            for first in range(0, samples, rows):
                count = min(rows, samples - first)
                chunk = [self._values(file, column, first, count) for column in columns]
                if any(len(values) != count for values in chunk):
                    raise truncated(
                        f"{self.path} ends before its {samples} samples", path=str(self.path), samples=samples
                    )
                yield chunk

    def _values(self, file: Any, column: Column, first: int, count: int) -> Any:
        group, index = column.key
        values, invalid = file.get(
            group=group, index=index, record_offset=first, record_count=count, samples_only=True,
            ignore_invalidation_bits=True,
        )  # fmt: skip
        if invalid is not None and np.any(invalid):
            values = np.where(invalid, np.nan, values)
        return values


def clock_of(file: Any, number: int, samples: int) -> bytes:
    """The times of a group at its beginning, middle and end; empty if it has no time."""
    index = file.masters_db.get(number)
    if index is None or not is_time(file.groups[number].channels[index]):
        return b""
    ends = [max(0, min(first, samples - _COMPARED)) for first in (0, samples // 2, samples - _COMPARED)]
    times = [file.get_master(number, record_offset=first, record_count=_COMPARED) for first in ends]
    return bytes(index.to_bytes(4, "little") + samples.to_bytes(8, "little") + np.concatenate(times).tobytes())


def is_time(channel: Any) -> bool:
    """Whether a master channel is a time, not an angle, a distance or an index."""
    return int(getattr(channel, "sync_type", TIME_MASTER)) == TIME_MASTER


def grouped(columns: Sequence[Column], clocks: Mapping[int, bytes]) -> tuple[Column, ...]:
    """The columns; if the file has several clocks, each group of columns is named after its time."""
    first = {times: number for number, times in reversed(list(clocks.items())) if times}
    if len(first) < 2:
        return tuple(columns)
    masters = {number: int.from_bytes(times[:4], "little") for times, number in first.items()}
    names = {c.key[0]: c.name for c in columns if masters.get(c.key[0]) == c.key[1]}
    columns_of_groups = []
    for column in columns:
        number, index = column.key
        of = first.get(clocks[number], number)
        columns_of_groups.append(
            replace(column, group=names.get(of, ""), clock=of in names and (number, index) == (of, masters[of]))
        )
    return tuple(columns_of_groups)


def unit_of(channel: Any) -> str:
    return str(getattr(channel, "unit", "") or "")


def open_mdf(path: Path, dbc: Path | None) -> Recording:
    """The channels of the file; with a DBC, or if there are no others, the signals in its CAN frames."""
    recording = MdfRecording(path)  # also checks sizes and places, which asammdf does not
    if dbc is not None and not recording.has_frames:
        raise no_frames(path, "MDF")
    if dbc is None and (recording.columns or not recording.has_frames):
        return recording
    return MdfCanRecording(path, dbc)
