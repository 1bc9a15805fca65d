"""The samples in a TwinCAT Scope project (.svdx): a table of acquisitions, each with its times and values in pieces.

Worked out from a project and its export. Behind a head and some levels of minima and maxima, which are not read, an
acquisition has pieces of mostly 16 samples: time of the first one, number of samples, first value, and for each other
sample its time after the first one and its value. Everything is little-endian, times are in 100 ns since 1601.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from livebode.sources import COLUMNS_MAX, damaged, oversized, truncated
from livebode_drives.formats import SCOPE_ENTRY, SCOPE_HEAD

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
        found = {
            handle: acquisition(file, at, at + span, offset) for at, span, handle in SCOPE_ENTRY.iter_unpack(table)
        }
    return (offset, length), found


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
    at, raw, passed = part.first, b"", 0
    with path.open("rb") as file:
        file.seek(at)
        while at < part.stop:
            if len(raw) - passed < PIECE.size:
                raw, passed = raw[passed:] + file.read(min(READ_BYTES, part.stop - at)), 0
            if len(raw) < PIECE.size:
                raise truncated(f"the samples at byte {at} end early", byte=at)
            count = PIECE.unpack_from(raw, passed)[1]
            layout = piece_of(count, kind, part.stop - at, at)
            if layout.itemsize > len(raw) - passed:
                raw, passed = raw[passed:] + file.read(max(layout.itemsize, READ_BYTES)), 0
            if layout.itemsize > len(raw):
                raise truncated(f"the samples at byte {at} end early", byte=at)
            whole = min(len(raw) - passed, part.stop - at) // layout.itemsize
            pieces = np.frombuffer(raw, layout, whole, passed)
            other = np.flatnonzero(pieces["count"] != count)
            pieces = pieces[: other[0]] if other.size else pieces
            at += pieces.nbytes
            passed += pieces.nbytes
            yield within(pieces, part.end)


def piece_of(count: int, kind: np.dtype[Any], most: int, at: int) -> np.dtype[Any]:
    """Layout of a piece of `count` samples, which is within `most` bytes."""
    width = 4 + kind.itemsize
    if not 0 < count <= most // width + 1 or PIECE.size + count * width - 4 > most:
        raise damaged(f"the piece at byte {at} declares {count} samples", byte=at)
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
