"""Sample numbers from timestamps, for senders that stamp their samples but do not number them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError
from livebode.sources.live import Batch

Sample = tuple[int, float, NDArray[np.float64]]
"""Number, stamp in seconds since 1970, and a value for each channel."""
NEAR = 0.5
"""A stamp within half a period of the time at which the next sample is due belongs to that sample."""


class StampNumbers:
    """Turns stamped samples into Batches: the number is the stamp times the rate, rounded.

    A stamp that differs from the due time by less than half of its batch continues the stream, so that jitter causes
    neither gaps nor repeats; a larger accumulated difference is detected as lost or repeated samples.
    """

    def __init__(self, channels: tuple[Channel, ...], rate_hz: float) -> None:
        self._channels, self._rate_hz = channels, rate_hz
        self._next: int | None = None

    def number(self, stamp_s: float, samples: int) -> int:
        """Number of the first of `samples` samples, which was taken at `stamp_s`, seconds since 1970."""
        if not 0 <= stamp_s < 1e11:
            raise SourceError(
                "value-invalid",
                f"the timestamp {stamp_s:g} s since 1970 is out of range",
                "set the sender's clock",
                key="stamp_s",
                value=stamp_s,
            )
        number = round(stamp_s * self._rate_hz)
        if self._next is not None and abs(number - self._next) <= NEAR * samples:
            number = self._next
        self._next = number + samples
        return number

    def sample(self, stamp_s: float, row: bytes) -> Sample:
        """One sample: a row of REAL or LREAL, taken at `stamp_s`. SourceError if it is not one."""
        taken = values(row, len(self._channels))
        return self.number(stamp_s, 1), stamp_s, taken

    def batches(self, samples: Sequence[Sample]) -> list[Batch]:
        """Batches of these samples; consecutive ones form one batch."""
        cuts = [0, *(i for i, (a, b) in enumerate(pairwise(samples), 1) if b[0] != a[0] + 1), len(samples)]
        pieces = [samples[a:b] for a, b in pairwise(cuts) if b > a]
        return [
            Batch(
                piece[0][0],
                np.stack([taken for _, _, taken in piece], axis=1),
                self._channels,
                self._rate_hz,
                stamp_s=piece[0][1],
            )
            for piece in pieces
        ]


def values(row: bytes, width: int) -> NDArray[np.float64]:
    """Numbers in a row of REAL or LREAL; its length determines the type."""
    dtype = {4 * width: "<f4", 8 * width: "<f8"}.get(len(row))
    if dtype is None:
        raise SourceError(
            "batch-shape",
            f"a sample of {len(row)} bytes is not a row of {width} REAL or LREAL",
            f"declare the symbol as ARRAY of {width} REAL or LREAL",
            bytes=len(row),
            channels=width,
        )
    with np.errstate(invalid="ignore"):
        return np.frombuffer(row, dtype).astype(np.float64)
