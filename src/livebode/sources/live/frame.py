"""The binary frame of livebode: what UDP, TCP and MQTT carry. docs/live.md has it byte by byte.

The header is little endian: magic, version, kind, flags, length, sequence, epoch, sample, stamp, rate, layout,
channels, samples; then the payload; then the CRC-32 of all before.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from livebode.nouns import Channel, InputError
from livebode.sources.live.batch import Batch, check_channels

MAGIC = b"LBOD"
VERSION = 1
SAMPLES, LAYOUT, SPECTRA = 1, 2, 3
"""Kinds of frames; SPECTRA is reserved."""
FLOAT64 = 1
"""Flag: the payload is float64 instead of float32."""
HEADER = struct.Struct("<4sBBHIIQQqdIHH")
CRC = struct.Struct("<I")
FRAME_BYTES_MIN = HEADER.size + CRC.size
FRAME_BYTES_MAX = 1 << 20
LAYOUT_BYTES_MAX = 1 << 16
SAMPLES_MAX = (1 << 16) - 1


@dataclass(frozen=True)
class Header:
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


def layout_text(channels: Sequence[Channel]) -> bytes:
    r"""Payload of a layout frame: a line for each channel, its name, a tab and its unit; UTF-8.

    >>> layout_text([Channel("w", "N m"), Channel("y")])
    b'w\tN m\ny\t\n'
    """
    return "".join(f"{channel.name}\t{channel.unit}\n" for channel in channels).encode("utf-8")


def encode_layout(channels: Sequence[Channel], rate_hz: float, *, epoch: int = 0, sequence: int = 0) -> bytes:
    """A frame that names the channels; a sender sends it first, and then once a second.

    >>> frame = encode_layout([Channel("w", "N m")], 4000)
    >>> len(frame), frame[:4]
    (66, b'LBOD')
    """
    text = layout_text(channels)
    return _framed(LAYOUT, 0, sequence, epoch, 0, 0, rate_hz, zlib.crc32(text), len(channels), 0, text)


def encode_samples(batch: Batch, *, sequence: int = 0, double: bool = False) -> bytes:
    """A frame with the samples of a batch, as float32 unless `double`.

    >>> batch = Batch(7, np.zeros((1, 10)), (Channel("w", "N m"),), 4000.0)
    >>> len(encode_samples(batch)), FrameDecoder().decode(encode_layout(batch.channels, 4000) ) is None
    (100, True)
    """
    channels, samples = batch.data.shape
    if samples > SAMPLES_MAX:
        raise InputError(f"{samples} samples do not fit into one frame; send at most {SAMPLES_MAX}")
    payload = np.ascontiguousarray(batch.data.T, dtype="<f8" if double else "<f4").tobytes()
    stamp_ns = 0 if batch.stamp_s is None else round(batch.stamp_s * 1e9)
    layout = zlib.crc32(layout_text(batch.channels))
    flags = FLOAT64 if double else 0
    return _framed(
        SAMPLES, flags, sequence, batch.epoch, batch.first_sample, stamp_ns, batch.rate_hz, layout, channels, samples,
        payload,
    )  # fmt: skip


def _framed(
    kind: int, flags: int, sequence: int, epoch: int, sample: int, stamp_ns: int, rate_hz: float, layout: int,
    channels: int, samples: int, payload: bytes,
) -> bytes:  # fmt: skip
    length = FRAME_BYTES_MIN + len(payload)
    if length > FRAME_BYTES_MAX:
        raise InputError(f"a frame of {length} bytes is longer than {FRAME_BYTES_MAX}; send fewer samples at once")
    head = HEADER.pack(
        MAGIC, VERSION, kind, flags, length, sequence, epoch, sample, stamp_ns, rate_hz, layout, channels, samples
    )
    return head + payload + CRC.pack(zlib.crc32(payload, zlib.crc32(head)))


def read_header(frame: bytes | memoryview) -> Header:
    """The header of what may be a frame; InputError where it cannot begin one."""
    if len(frame) < FRAME_BYTES_MIN:
        raise InputError(f"a frame of {len(frame)} bytes is shorter than a header")
    header = Header(*HEADER.unpack_from(frame))
    if header.magic != MAGIC:
        raise InputError(f"a frame begins with {bytes(frame[:4])!r} instead of {MAGIC!r}")
    if header.version != VERSION:
        raise InputError(f"a frame of version {header.version}; this livebode reads version {VERSION}")
    if not FRAME_BYTES_MIN <= header.length <= FRAME_BYTES_MAX:
        raise InputError(f"a frame declares {header.length} bytes, not {FRAME_BYTES_MIN} to {FRAME_BYTES_MAX}")
    return header


class FrameDecoder:
    """Turns frames into Batches; remembers the layouts that were announced."""

    LAYOUTS_MAX = 16

    def __init__(self) -> None:
        self._layouts: dict[int, tuple[Channel, ...]] = {}

    def decode(self, frame: bytes | memoryview, arrived_s: float = float("nan")) -> Batch | None:
        """The batch in a frame; None for a layout and for samples whose layout has not come yet.

        Raises
        ------
        InputError
            Where the frame is damaged, of another version or kind, or contradicts itself.
        """
        header = read_header(frame)
        if header.length != len(frame):
            raise InputError(f"a frame declares {header.length} bytes and has {len(frame)}")
        if zlib.crc32(frame[: -CRC.size]) != CRC.unpack_from(frame, len(frame) - CRC.size)[0]:
            raise InputError("a frame's CRC is wrong")
        payload = frame[HEADER.size : -CRC.size]
        if header.kind == LAYOUT:
            self._remember(header, bytes(payload))
            return None
        if header.kind != SAMPLES or header.flags & ~FLOAT64:
            raise InputError(f"a frame of kind {header.kind} with flags {header.flags} is not known")
        return self._samples(header, payload, arrived_s)

    def _remember(self, header: Header, text: bytes) -> None:
        if len(text) > LAYOUT_BYTES_MAX or zlib.crc32(text) != header.layout:
            raise InputError(f"a layout of {len(text)} bytes is too long or not the one that its header names")
        try:
            lines = text.decode("utf-8").removesuffix("\n").split("\n")
        except UnicodeDecodeError:
            raise InputError("a layout is not UTF-8") from None
        channels = tuple(Channel(*line.partition("\t")[::2]) for line in lines)
        check_channels(channels)
        if len(channels) != header.channels:
            raise InputError(f"a layout names {len(channels)} channels, its header {header.channels}")
        self._layouts.pop(header.layout, None)
        self._layouts[header.layout] = channels
        while len(self._layouts) > self.LAYOUTS_MAX:
            del self._layouts[next(iter(self._layouts))]

    def _samples(self, header: Header, payload: bytes | memoryview, arrived_s: float) -> Batch | None:
        dtype = np.dtype("<f8" if header.flags & FLOAT64 else "<f4")
        if len(payload) != header.channels * header.samples * dtype.itemsize:
            raise InputError(
                f"a frame of {header.channels} channels and {header.samples} samples has {len(payload)} bytes of them"
            )
        channels = self._layouts.get(header.layout)
        if channels is None:
            return None
        if len(channels) != header.channels:
            raise InputError(f"a frame has {header.channels} channels, its layout {len(channels)}")
        with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
            data = np.frombuffer(payload, dtype).reshape(header.samples, header.channels).T.astype("f8", order="C")
        return Batch(
            header.sample,
            data,
            channels,
            header.rate_hz,
            header.epoch,
            header.stamp_ns / 1e9 if header.stamp_ns else None,
            arrived_s,
        )


class FrameSplitter:
    """Cuts a stream of bytes into frames, and finds the next one behind rubbish. Memory: one frame."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self.skipped = 0
        """Bytes that belonged to no frame."""
        self.damaged = 0
        """Frames with a wrong CRC since the last whole one."""

    def feed(self, piece: bytes) -> list[bytes]:
        """Frames that `piece` completes."""
        self._bytes += piece
        frames = []
        while len(self._bytes) >= FRAME_BYTES_MIN:
            try:
                header = read_header(bytes(self._bytes[:FRAME_BYTES_MIN]))
            except InputError:
                self._skip()
                continue
            if len(self._bytes) < header.length:
                break
            frame = bytes(self._bytes[: header.length])
            if zlib.crc32(frame[: -CRC.size]) != CRC.unpack(frame[-CRC.size :])[0]:
                self.damaged += 1
                self._skip()  # its length may be what is damaged
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
