"""The binary frame of livebode, for UDP, TCP and MQTT. docs/how-to/live.md describes it byte by byte."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from livebode.core import Channel, SourceError, SpectraLayout
from livebode.sources.live.batch import Batch, check_channels
from livebode.sources.live.framing import (
    CRC,
    FLOAT64,
    HEADER,
    LAYOUT,
    LAYOUT_BYTES_MAX,
    SAMPLES,
    SAMPLES_MAX,
    SPECTRA,
    SPECTRA_LAYOUT,
    Header,
    damaged_frame,
    framed,
    inconsistent_frame,
    read_header,
)
from livebode.sources.live.spectra_batch import AnyBatch
from livebode.sources.live.spectra_frame import read_spectra, read_spectra_text

AnyLayout = tuple[Channel, ...] | SpectraLayout
_REMEMBERED, _REMEMBERED_BYTES_MAX = 256, 4096
"""Most layouts that are remembered after they were read, and most bytes of the text of one."""


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
    return framed(LAYOUT, 0, sequence, epoch, 0, 0, rate_hz, zlib.crc32(text), len(channels), 0, text)


def encode_samples(batch: Batch, *, sequence: int = 0, double: bool = False) -> bytes:
    """A frame with the samples of a batch, as float32, or as float64 with `double`.

    >>> batch = Batch(7, np.zeros((1, 10)), (Channel("w", "N m"),), 4000.0)
    >>> len(encode_samples(batch)), FrameDecoder().decode(encode_layout(batch.channels, 4000) ) is None
    (100, True)
    """
    channels, samples = batch.data.shape
    if samples > SAMPLES_MAX:
        raise SourceError(
            "frame-too-long",
            f"{samples} samples do not fit into one frame",
            f"send at most {SAMPLES_MAX} at once",
            samples=samples,
            maximum=SAMPLES_MAX,
        )
    payload = np.ascontiguousarray(batch.data.T, dtype="<f8" if double else "<f4").tobytes()
    stamp_ns = 0 if batch.stamp_s is None else round(batch.stamp_s * 1e9)
    layout = zlib.crc32(layout_text(batch.channels))
    flags = FLOAT64 if double else 0
    return framed(
        SAMPLES, flags, sequence, batch.epoch, batch.first_sample, stamp_ns, batch.rate_hz, layout, channels, samples,
        payload,
    )  # fmt: skip


class FrameDecoder:
    """Turns frames into Batches; remembers the announced layouts."""

    LAYOUTS_MAX = 16

    def __init__(self) -> None:
        self._layouts: dict[tuple[int, int], AnyLayout] = {}

    def decode(self, frame: bytes | memoryview, arrived_s: float = float("nan")) -> AnyBatch | None:
        """The batch in a frame; None for a layout, and for samples or spectra whose layout is not known yet.

        Raises
        ------
        SourceError
            If the frame is damaged, inconsistent, or of an unknown version or kind.
        """
        header = read_header(frame)
        if header.length != len(frame):
            raise damaged_frame(f"a frame declares {header.length} bytes and has {len(frame)}", bytes=len(frame))
        if zlib.crc32(frame[: -CRC.size]) != CRC.unpack_from(frame, len(frame) - CRC.size)[0]:
            raise damaged_frame("a frame's CRC is wrong")
        payload = frame[HEADER.size : -CRC.size]
        if header.kind not in (SAMPLES, LAYOUT, SPECTRA, SPECTRA_LAYOUT) or header.flags & ~FLOAT64:
            raise SourceError(
                "frame-unsupported",
                f"a frame of kind {header.kind} with flags {header.flags} is not supported",
                "update livebode, or correct the sender",
                frame_kind=header.kind,
                flags=header.flags,
            )
        if header.kind in (LAYOUT, SPECTRA_LAYOUT):
            self._remember(header, bytes(payload))
            return None
        if header.kind == SAMPLES:
            channels = self._layouts.get((LAYOUT, header.layout))
            return None if not isinstance(channels, tuple) else _samples(header, payload, channels, arrived_s)
        layout = self._layouts.get((SPECTRA_LAYOUT, header.layout))
        return None if not isinstance(layout, SpectraLayout) else read_spectra(header, payload, layout, arrived_s)

    def _remember(self, header: Header, text: bytes) -> None:
        if len(text) > LAYOUT_BYTES_MAX or zlib.crc32(text) != header.layout:
            raise inconsistent_frame(f"a layout of {len(text)} bytes is too long or not the one that its header names")
        read = _short_layout if len(text) <= _REMEMBERED_BYTES_MAX else _read_layout
        layout, count = read(header.kind, text)
        if count != header.channels:
            raise inconsistent_frame(
                f"a layout names {count} channels, its header {header.channels}", channels=[count, header.channels]
            )
        key = (header.kind, header.layout)
        self._layouts.pop(key, None)
        self._layouts[key] = layout
        while len(self._layouts) > self.LAYOUTS_MAX:
            del self._layouts[next(iter(self._layouts))]


def _read_layout(kind: int, text: bytes) -> tuple[AnyLayout, int]:
    """The layout in the payload of a frame of this kind, and the number of its channels."""
    if kind == LAYOUT:
        channels = _read_layout_text(text)
        return channels, len(channels)
    layout = read_spectra_text(text)
    return layout, len(layout.signals) + len(layout.values)


# Senders repeat their layout, in a log with each message: reading it costs more than reading the samples.
_short_layout = lru_cache(maxsize=_REMEMBERED)(_read_layout)


def _read_layout_text(text: bytes) -> tuple[Channel, ...]:
    try:
        lines = text.decode("utf-8").removesuffix("\n").split("\n")
    except UnicodeDecodeError:
        raise SourceError("layout-invalid", "a layout is not UTF-8", "correct the sender") from None
    channels = tuple(Channel(*line.partition("\t")[::2]) for line in lines)
    check_channels(channels)
    return channels


def _samples(header: Header, payload: bytes | memoryview, channels: tuple[Channel, ...], arrived_s: float) -> Batch:
    dtype = np.dtype("<f8" if header.flags & FLOAT64 else "<f4")
    if len(payload) != header.channels * header.samples * dtype.itemsize:
        raise inconsistent_frame(
            f"a frame of {header.channels} channels and {header.samples} samples has {len(payload)} bytes of them",
            channels=header.channels,
            samples=header.samples,
            bytes=len(payload),
        )
    if len(channels) != header.channels:
        raise inconsistent_frame(
            f"a frame has {header.channels} channels, its layout {len(channels)}",
            channels=[header.channels, len(channels)],
        )
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
