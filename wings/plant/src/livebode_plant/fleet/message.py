"""Messages of the log: a batch of a machine with its layout, complete in itself."""

from __future__ import annotations

from hashlib import blake2b

import numpy as np

from livebode.sources.live import (
    AnyBatch,
    FrameDecoder,
    SpectraBatch,
    damaged_frame,
    encode_layout,
    encode_samples,
    encode_spectra,
    encode_spectra_layout,
    read_header,
)

_DIGEST_BYTES = 16


def write_message(batch: AnyBatch) -> bytes:
    """The batch as a frame of its layout and a frame of its samples or spectra; float32 where that is exact."""
    if isinstance(batch, SpectraBatch):
        double = not (_exact(batch.sums, np.complex64) and _exact(batch.values, np.float32))
        layout = encode_spectra_layout(batch.layout, batch.rate_hz, epoch=batch.epoch)
        return layout + encode_spectra(batch, double=double)
    layout = encode_layout(batch.channels, batch.rate_hz, epoch=batch.epoch)
    return layout + encode_samples(batch, double=not _exact(batch.data, np.float32))


def read_message(message: bytes, arrived_s: float) -> AnyBatch:
    """The batch in a message.

    Raises
    ------
    SourceError
        If it is not a layout and a frame of samples or spectra, or damaged.
    """
    decoder, frames = FrameDecoder(), memoryview(message)
    layout = read_header(frames).length
    decoder.decode(frames[:layout])
    batch = decoder.decode(frames[layout:], arrived_s)
    if batch is None:
        raise damaged_frame("a message has no samples, or not the layout of its samples")
    return batch


def message_id(key: str, message: bytes) -> str:
    """The name by which the log detects a repeated message: axis, epoch, number of the first sample, and a digest.

    The names of all axes are in one list at the server. Without the digest, which nobody knows before the samples, a
    hostile edge could store messages under the next names of another axis, and the log would drop its messages.
    """
    batch = read_message(message, 0.0)
    digest = blake2b(message, digest_size=_DIGEST_BYTES).hexdigest()
    return f"{key}:{batch.epoch}:{batch.first_sample}:{digest}"


def _exact(values: np.ndarray, kind: type) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.array_equal(values.astype(kind), values, equal_nan=True))
