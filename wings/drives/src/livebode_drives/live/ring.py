"""The array ring buffer in a PLC program, as bytes: a header, and a row for each of the last samples.

docs/how-to/live.md has the program that fills it, and the layout byte by byte.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from livebode.core import Channel, SourceError
from livebode.sources.live import CHANNELS_MAX, SAMPLE_MAX, VALUES_MAX, Batch

MAGIC = 0x474E524C  # "LRNG"
VERSION = 1
HEADER = struct.Struct("<IHHIIdQQ")
FILETIME_1970 = 116_444_736_000_000_000
"""The year 1970 in the PLC's unit of time: 100 ns since 1601."""


@dataclass(frozen=True)
class Ring:
    """The header at one time: `count` samples were written, the last one at `stamp` (100 ns since 1601)."""

    magic: int
    version: int
    channels: int
    length: int
    epoch: int
    rate_hz: float
    stamp: int
    count: int

    @property
    def stamp_s(self) -> float | None:
        """When the last sample was written, seconds since 1970; None if the PLC does not state it."""
        return (self.stamp - FILETIME_1970) / 1e7 if self.stamp else None


def read_ring(raw: bytes, symbol_bytes: int) -> tuple[Ring, np.dtype[np.floating]]:
    """The header in `raw`, and the type of the numbers after it, derived from the size of the whole symbol.

    Raises
    ------
    SourceError
        If it is not a ring, or its numbers contradict its size.
    """
    if len(raw) < HEADER.size:
        raise wrong_ring(f"a ring of {len(raw)} bytes is shorter than its header", bytes=len(raw))
    ring = Ring(*HEADER.unpack_from(raw))
    if ring.magic != MAGIC or ring.version != VERSION:
        raise wrong_ring(
            f"the symbol is not a ring of version {VERSION}: it begins with {raw[:6].hex(' ')}", beginning=raw[:6].hex()
        )
    values = ring.channels * ring.length
    if not (0 < ring.channels <= CHANNELS_MAX and ring.length > 1 and values <= VALUES_MAX):
        raise wrong_ring(
            f"a ring of {ring.length} samples of {ring.channels} channels is empty or too large",
            channels=ring.channels,
            samples=ring.length,
        )
    if not 1e-9 < ring.rate_hz < 1e9:
        raise wrong_ring(
            f"the ring's rate_hz={ring.rate_hz} is not a number of samples per second", rate_hz=ring.rate_hz
        )
    for dtype in (np.dtype("<f4"), np.dtype("<f8")):
        if HEADER.size + values * dtype.itemsize == symbol_bytes:
            return ring, dtype
    raise SourceError(
        "ring-invalid",
        f"a ring of {ring.length} samples of {ring.channels} channels does not have {symbol_bytes} bytes",
        "declare its data as ARRAY [0..length-1, 0..channels-1] OF REAL or LREAL",
        channels=ring.channels,
        samples=ring.length,
        bytes=symbol_bytes,
    )


def wrong_ring(message: str, **facts: object) -> SourceError:
    return SourceError(
        "ring-invalid", message, "check source.symbol and the PLC program (docs/how-to/live.md)", **facts
    )


def new_rows(ring: Ring, have: int | None) -> list[tuple[int, int]]:
    """Samples to read, as ranges that are contiguous in the ring: those after `have` that are not overwritten yet.

    >>> new_rows(Ring(MAGIC, 1, 1, 100, 0, 4000.0, 0, 250), 190)
    [(190, 200), (200, 250)]
    """
    # The slot of the oldest sample is written next.
    first = max(ring.count - ring.length + 1, 0 if have is None else have)
    if have is not None and have > ring.count:
        first = max(ring.count - ring.length + 1, 0)
    turn = ring.count // ring.length * ring.length
    if first < turn < ring.count:
        return [(first, turn), (turn, ring.count)]
    return [(first, ring.count)] if first < ring.count else []


def ring_batch(
    raw: bytes, first: int, ring: Ring, after: Ring, dtype: np.dtype[np.floating], channels: tuple[Channel, ...]
) -> Batch | None:
    """The rows from sample `first`, without those overwritten by the time of `after`; None if there are none."""
    if len(channels) != ring.channels:
        raise SourceError(
            "channels-invalid",
            f"the ring has {ring.channels} channels, and source.channels names {len(channels)}",
            "correct source.channels",
            key="source.channels",
            channels=[ring.channels, len(channels)],
        )
    if (after.epoch, after.length, after.channels) != (ring.epoch, ring.length, ring.channels):
        return None
    if not 0 <= ring.count <= after.count < SAMPLE_MAX:
        return None
    with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
        data = np.frombuffer(raw, dtype).reshape(-1, ring.channels).T.astype(np.float64, order="C")
    lost = max(0, after.count - ring.length + 1 - first)
    if lost >= data.shape[1]:
        return None
    start = first + lost
    stamp_s = None if ring.stamp_s is None else ring.stamp_s - (ring.count - 1 - start) / ring.rate_hz
    return Batch(start, data[:, lost:], channels, ring.rate_hz, ring.epoch, stamp_s)
