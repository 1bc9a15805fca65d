"""Projects of TwinCAT Scope with their data (.svdx): binary samples, and XML that names and scales them.

The place of the samples was worked out from a project and its export. Behind a head and some levels of minima and
maxima, which are not read, an acquisition has pieces of mostly 16 samples: time of the first one, number of samples,
first value, and for each other sample its time after the first one and its value. Everything is little-endian, times
are in 100 ns since 1601.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import IO, Any, ClassVar
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from livebode.dataclass import dataclass
from livebode.sources import COLUMNS_MAX, Chunk, Column, Recording, Skipped, damaged, oversized, truncated
from livebode_drives.formats import SCOPE_ENTRY, SCOPE_HEAD
from livebode_drives.recordings.safexml import parse
from livebode_drives.recordings.timed_columns import TimedColumns, as_columns
from livebode_drives.recordings.twincat import QUANTITY, TIME
from livebode_drives.recordings.twincatwords import unique_names

VERSION = b"01.00.00.40"
ACQUISITION = struct.Struct(f"<{len(VERSION)}sQQQQQQQ")
"""Version, first time, unknown, start and end of the record, number of levels, samples of a piece, sample time."""
LEVEL = struct.Struct("<QQIQQQQI")
"""A level, of which number 0 is that of the samples; the fourth entry is its offset."""
LEVELS_MAX = 64
PIECE = struct.Struct("<QQ")
READ_BYTES = 1 << 18
TICKS_TO_1970 = 116_444_736_000_000_000
NS_PER_TICK = 100

Samples = tuple[NDArray[np.int64], NDArray[Any]]
"""Times in ns since 1970, and values."""


@dataclass(frozen=True)
class Acquisition:
    """Where the samples of an acquisition are in the file, and the time at which the record ends."""

    first: int
    stop: int
    end: int


def read_table(path: Path) -> tuple[tuple[int, int], dict[int, Acquisition]]:
    """Offset and length of the XML, and the acquisitions by their handles."""
    size = path.stat().st_size
    with path.open("rb") as file:
        offset, length, count = SCOPE_HEAD.unpack(file.read(SCOPE_HEAD.size))
        if offset + length > size:
            declared = offset + length
            raise truncated(f"the project declares {declared} bytes, more than there are", declared=declared)
        if count > COLUMNS_MAX:
            raise oversized(f"the project has {count} acquisitions, more than {COLUMNS_MAX}", COLUMNS_MAX)
        table = file.read(count * SCOPE_ENTRY.size)
        if len(table) < count * SCOPE_ENTRY.size:
            raise truncated(f"the table of {count} acquisitions ends early")
        acquisitions = {
            handle: acquisition(file, first, first + span, offset)
            for first, span, handle in SCOPE_ENTRY.iter_unpack(table)
        }
    return (offset, length), acquisitions


def acquisition(file: IO[bytes], first: int, stop: int, limit: int) -> Acquisition:
    """The acquisition in these bytes, from its head."""
    if not first + ACQUISITION.size <= stop <= limit:
        raise truncated(f"an acquisition declares bytes {first} to {stop} of {limit}")
    file.seek(first)
    version, _, _, _, end, levels, _, _ = ACQUISITION.unpack(file.read(ACQUISITION.size))
    if version != VERSION:
        raise damaged(f"its data has version {version!r}; known is {VERSION!r}")
    if not 0 < levels <= LEVELS_MAX:
        raise damaged(f"an acquisition declares {levels} levels")
    file.seek(LEVEL.size * (levels - 1), 1)
    last = file.read(LEVEL.size).ljust(LEVEL.size, b"\0")
    _, _, number, offset, *_ = LEVEL.unpack(last)
    if number != 0 or not ACQUISITION.size + levels * LEVEL.size <= offset <= stop - first:
        raise damaged(f"an acquisition has no samples at byte {first + offset}", byte=first + offset)
    return Acquisition(first + offset, stop, end)


def samples_of(path: Path, part: Acquisition, kind: np.dtype[Any]) -> Iterator[Samples]:
    """Times and values of the samples that are not after the end of the record, some at a time."""
    position, raw, passed = part.first, b"", 0
    with path.open("rb") as file:
        file.seek(position)
        while position < part.stop:
            if len(raw) - passed < PIECE.size:
                raw, passed = raw[passed:] + file.read(min(READ_BYTES, part.stop - position)), 0
            if len(raw) < PIECE.size:
                raise truncated(f"the samples at byte {position} end early", byte=position)
            count = PIECE.unpack_from(raw, passed)[1]
            layout = piece_of(count, kind, part.stop - position, position)
            if layout.itemsize > len(raw) - passed:
                raw, passed = raw[passed:] + file.read(max(layout.itemsize, READ_BYTES)), 0
            if layout.itemsize > len(raw):
                raise truncated(f"the samples at byte {position} end early", byte=position)
            whole = min(len(raw) - passed, part.stop - position) // layout.itemsize
            pieces = np.frombuffer(raw, layout, whole, passed)
            other = np.flatnonzero(pieces["count"] != count)
            pieces = pieces[: other[0]] if other.size else pieces
            position += pieces.nbytes
            passed += pieces.nbytes
            yield within(pieces, part.end)


def piece_of(count: int, kind: np.dtype[Any], most: int, position: int) -> np.dtype[Any]:
    """Layout of a piece of `count` samples, which is within `most` bytes."""
    width = 4 + kind.itemsize
    if not 0 < count <= most // width + 1 or PIECE.size + count * width - 4 > most:
        raise damaged(f"the piece at byte {position} declares {count} samples", byte=position)
    later = np.dtype([("after", "<u4"), ("value", kind)])
    return np.dtype([("start", "<u8"), ("count", "<u8"), ("first", kind), ("later", later, (count - 1,))])


def within(pieces: NDArray[Any], end: int) -> Samples:
    """The samples of pieces of one length up to the end of the record, in their order."""
    shape = len(pieces), 1 + pieces["later"].shape[1]
    ticks, values = np.empty(shape, np.uint64), np.empty(shape, pieces["first"].dtype)
    ticks[:, 0], ticks[:, 1:] = pieces["start"], pieces["start"][:, None] + pieces["later"]["after"]
    values[:, 0], values[:, 1:] = pieces["first"], pieces["later"]["value"]
    recorded = ticks.ravel() <= end
    times_ns = (ticks.ravel()[recorded].view(np.int64) - TICKS_TO_1970) * NS_PER_TICK
    return times_ns, values.ravel()[recorded]


TYPES = {
    "BIT": "u1", "BOOL": "u1", "INT8": "i1", "INT16": "<i2", "INT32": "<i4", "INT64": "<i8", "UINT8": "u1",
    "UINT16": "<u2", "UINT32": "<u4", "UINT64": "<u8", "REAL32": "<f4", "REAL64": "<f8",
}  # fmt: skip
ALL_BITS = (1 << 64) - 1


@dataclass(frozen=True)
class ChannelScale:
    """Where the raw values of a channel are, and its physical values: factor·raw + offset."""

    handle: int
    factor: float = 1.0
    offset: float = 0.0

    def values(self, raw: NDArray[Any]) -> NDArray[Any]:
        return raw if (self.factor, self.offset) == (1.0, 0.0) else raw * self.factor + self.offset


class ScopeProjectRecording(Recording):
    """A project of TwinCAT Scope. Channels have the names, scaling and units of the charts; what no chart shows goes
    by the name of its acquisition. Acquisitions of equal times have one clock, in ns since 1970."""

    format: ClassVar[str] = "svdx"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        (first, length), self._parts = read_table(path)
        root = parse(path, first, length)
        self._kinds: dict[int, np.dtype[Any]] = {}
        columns: list[Column] = []
        skipped: list[Skipped] = []
        shown = list(shown_acquisitions(root))
        for item in (*shown, *hidden_acquisitions(root, shown)):
            if len(columns) > COLUMNS_MAX:
                raise oversized(f"{path} has more than {COLUMNS_MAX} channels", COLUMNS_MAX)
            if why := self._unreadable(item):
                skipped.append(Skipped(item.name, why))
            else:
                columns.append(item.column())
        self.columns, self.skipped = tuple(as_columns(self._by_clock(distinct(columns)))), tuple(skipped)

    def _unreadable(self, item: ChannelDisplay) -> str:
        """Why the data of an acquisition is not read; empty if it is."""
        data = item.acquisition
        type_, handle = text(data, "DataType"), int(text(data, "FileHandle") or 0)
        if handle not in self._parts:
            return "its data is not in the file"
        if text(data, "CompressionMode") not in ("", "Uncompressed"):
            return f"its data is compressed ({text(data, 'CompressionMode')}): export it as CSV"
        if type_ not in TYPES:
            return f"its values are of type {type_}, not numbers"
        if item.bits != ALL_BITS:
            return "it shows single bits of its variable: export it as CSV"
        self._kinds[handle] = np.dtype(TYPES[type_])
        return ""

    def _by_clock(self, columns: Sequence[Column]) -> list[TimedColumns]:
        """The channels by their times, those with most channels first; each acquisition is read once for that."""
        groups: dict[tuple[int, bytes], list[Column]] = {}
        seen: dict[int, tuple[int, bytes]] = {}
        for column in columns:
            handle = column.key.handle
            if handle not in seen:
                seen[handle] = self._times_of(handle)
            groups.setdefault(seen[handle], []).append(column)
        timed = [
            TimedColumns(Column(TIME, "ns", temporal=True, key=channels[0].key.handle), tuple(channels), samples)
            for (samples, _), channels in groups.items()
            if samples
        ]
        return sorted(timed, key=lambda group: -len(group.channels))

    def _times_of(self, handle: int) -> tuple[int, bytes]:
        """Number and fingerprint of the times of an acquisition."""
        samples, digest = 0, hashlib.blake2b()
        for times_ns, _ in self._samples(handle):
            samples += len(times_ns)
            digest.update(times_ns.tobytes())
        return samples, digest.digest()

    def _samples(self, handle: int) -> Iterator[Samples]:
        return samples_of(self.path, self._parts[handle], self._kinds[handle])

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        keys = [column.key if isinstance(column.key, ChannelScale) else ChannelScale(column.key) for column in columns]
        handles = list(dict.fromkeys(key.handle for key in keys))
        for parts in zip(*(even(self._samples(handle), rows) for handle in handles), strict=True):
            read = dict(zip(handles, parts))
            yield [
                read[key.handle][0] if column.temporal else key.values(read[key.handle][1])
                for column, key in zip(columns, keys)
            ]


def even(pieces: Iterator[Samples], rows: int) -> Iterator[Samples]:
    """The samples `rows` at a time."""
    held: list[Samples] = []
    count = 0
    for piece in chain(pieces, [None]):
        if piece is not None:
            held.append(piece)
            count += len(piece[0])
        if count >= rows or (piece is None and count):
            times, values = (np.concatenate(parts) for parts in zip(*held))
            full = count if piece is None else count - count % rows
            for first in range(0, full, rows):
                yield times[first : min(first + rows, full)], values[first : min(first + rows, full)]
            held, count = [(times[full:], values[full:])], count - full


@dataclass(frozen=True)
class ChannelDisplay:
    """A channel: its name, the acquisition with its data, and how a chart scales it."""

    name: str
    acquisition: Element
    interpreter: Element | None = None

    @property
    def bits(self) -> int:
        return int(text(self.interpreter, "BitMask") or ALL_BITS)

    def column(self) -> Column:
        """The channel; first its own scaling applies, then that of its unit."""
        own, symbol = self.interpreter, text(self.acquisition, "SymbolName")
        scale, offset = number(own, "ScaleFactor", 1.0), number(own, "Offset", 0.0)
        again = number(own, "ResultingUnit/UnitScaleResult", 1.0)
        shift = number(own, "ResultingUnit/UnitOffsetResult", 0.0)
        key = ChannelScale(int(text(self.acquisition, "FileHandle")), scale * again, offset * again + shift)
        unit = QUANTITY.sub("", f" {text(own, 'ResultingUnit/Unit/ReturnText')}").strip()
        return Column(self.name, unit, aliases=(symbol,) if symbol not in ("", self.name) else (), key=key)


def text(element: Element | None, path: str) -> str:
    return (element.findtext(path) or "").strip() if element is not None else ""


def number(element: Element | None, path: str, default: float) -> float:
    content = text(element, path)
    return float(content) if content else default


def shown_acquisitions(root: Element) -> Iterator[ChannelDisplay]:
    """What the charts show; the x of an XY chart as NAME.X."""
    by_guid = {text(node, "Guid"): node for node in root.iter() if node.find("FileHandle") is not None}
    for channel in root.iter("Channel"):
        for own in channel.iter("AcquisitionInterpreter"):
            data = by_guid.get(text(own, "AcquisitionGUID"))
            if data is not None:
                usage = text(own, "Usage")
                yield ChannelDisplay(text(channel, "Name") + (f".{usage}" if usage not in ("", "Y") else ""), data, own)


def hidden_acquisitions(root: Element, shown: Sequence[ChannelDisplay]) -> Iterator[ChannelDisplay]:
    known = {id(channel.acquisition) for channel in shown}
    for node in root.iter():
        if node.find("FileHandle") is not None and id(node) not in known:
            yield ChannelDisplay(text(node, "Name"), node)


def distinct(columns: Sequence[Column]) -> list[Column]:
    """Each channel once, with a name of its own."""
    different = list({(column.name, column.key): column for column in columns}.values())
    names = unique_names([column.name for column in different], [(*column.aliases, "")[0] for column in different])
    return [replace(column, name=name) for column, name in zip(different, names)]
