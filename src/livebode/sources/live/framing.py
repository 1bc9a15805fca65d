"""Common to all frames: header, CRC, and how frames are cut out of a stream.

The header is little endian: magic, version, kind, flags, length, sequence, epoch, sample, stamp, rate, layout,
channels, samples; then the payload; then the CRC-32 of all before.
"""

from __future__ import annotations

import struct
import zlib
from typing import NamedTuple

from livebode.core import SourceError

MAGIC = b"LBOD"
VERSION = 1
SAMPLES, LAYOUT, SPECTRA, SPECTRA_LAYOUT = 1, 2, 3, 4
"""Kinds of frames."""
FLOAT64 = 1
"""Flag: the payload is float64 instead of float32."""
HEADER = struct.Struct("<4sBBHIIQQqdIHH")
CRC = struct.Struct("<I")
FRAME_BYTES_MIN = HEADER.size + CRC.size
FRAME_BYTES_MAX = 1 << 20
LAYOUT_BYTES_MAX = 1 << 16
SAMPLES_MAX = (1 << 16) - 1


class Header(NamedTuple):
    """The fields of a frame's header, in their order; `stamp_ns` is 0 where the sender has no clock."""

    magic: bytes
    version: int
    kind: int
    flags: int
    length: int
    sequence: int
    epoch: int
    sample: int
    stamp_ns: int
    rate_hz: float
    layout: int
    channels: int
    samples: int


def framed(
    kind: int, flags: int, sequence: int, epoch: int, sample: int, stamp_ns: int, rate_hz: float, layout: int,
    channels: int, samples: int, payload: bytes,
) -> bytes:  # fmt: skip
    """A complete frame; SourceError if it would be too long."""
    length = FRAME_BYTES_MIN + len(payload)
    if length > FRAME_BYTES_MAX:
        raise SourceError(
            "frame-too-long",
            f"a frame of {length} bytes is longer than {FRAME_BYTES_MAX}",
            "send fewer samples at once",
            bytes=length,
            maximum=FRAME_BYTES_MAX,
        )
    head = HEADER.pack(
        MAGIC, VERSION, kind, flags, length, sequence, epoch, sample, stamp_ns, rate_hz, layout, channels, samples
    )
    return head + payload + CRC.pack(zlib.crc32(payload, zlib.crc32(head)))


def read_header(frame: bytes | memoryview) -> Header:
    """The header of a possible frame; SourceError if it is not a valid one."""
    if len(frame) < FRAME_BYTES_MIN:
        raise damaged_frame(f"a frame of {len(frame)} bytes is shorter than a header", bytes=len(frame))
    header = Header(*HEADER.unpack_from(frame))
    if header.magic != MAGIC:
        raise damaged_frame(
            f"a frame begins with {bytes(frame[:4])!r} instead of {MAGIC!r}", beginning=bytes(frame[:4]).hex()
        )
    if header.version != VERSION:
        raise SourceError(
            "frame-unsupported",
            f"a frame has version {header.version}; this livebode reads version {VERSION}",
            "update livebode, or correct the sender",
            version=header.version,
        )
    if not FRAME_BYTES_MIN <= header.length <= FRAME_BYTES_MAX:
        raise damaged_frame(
            f"a frame declares {header.length} bytes, not {FRAME_BYTES_MIN} to {FRAME_BYTES_MAX}", bytes=header.length
        )
    return header


def damaged_frame(message: str, **facts: object) -> SourceError:
    return SourceError("frame-damaged", message, "check the sender and the connection", **facts)


def inconsistent_frame(message: str, **facts: object) -> SourceError:
    return SourceError("frame-inconsistent", message, "correct the sender", **facts)


class FrameSplitter:
    """Cuts a stream of bytes into frames, and finds the next one after invalid bytes. Memory: one frame."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self.skipped = 0
        """Bytes that did not belong to a frame."""
        self.damaged = 0
        """Frames with a wrong CRC since the last intact one."""

    def feed(self, piece: bytes) -> list[bytes]:
        """Frames completed by `piece`."""
        self._bytes += piece
        frames = []
        while len(self._bytes) >= FRAME_BYTES_MIN:
            try:
                header = read_header(bytes(self._bytes[:FRAME_BYTES_MIN]))
            except SourceError:
                self._skip()
                continue
            if len(self._bytes) < header.length:
                break
            frame = bytes(self._bytes[: header.length])
            if zlib.crc32(frame[: -CRC.size]) != CRC.unpack(frame[-CRC.size :])[0]:
                self.damaged += 1
                self._skip()  # its length field may be damaged
                continue
            self.damaged = 0
            del self._bytes[: header.length]
            frames.append(frame)
        return frames

    def _skip(self) -> None:
        at = self._bytes.find(MAGIC, 1)
        cut = at if at > 0 else max(1, len(self._bytes) - len(MAGIC) + 1)
        self.skipped += cut
        del self._bytes[:cut]
