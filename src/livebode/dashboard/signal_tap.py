"""Signal tap: the newest samples of an axis, retained only while somebody looks at them."""

from __future__ import annotations

import math
import threading
import time
from collections import deque

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Spectra
from livebode.dataclass import dataclass

WATCHED_S = 2.0
"""Samples are retained for this long after the last request."""
SPAN_S = 1.0
WINDOWS = 2
"""Whole windows that are retained if they are longer than a second: two tell neighbouring lines apart."""
VALUES_MAX = 1 << 21
"""Largest number of samples × channels, 16 MB; the span is shorter if the rate is too high for it."""


def span_samples(rate_hz: float, window: int, channels: int) -> int:
    """Samples of a picture of the signals: a second, or two windows if they are longer.

    >>> span_samples(4000, 400, 4), span_samples(100, 400, 4)
    (4000, 800)
    """
    return max(1, min(max(math.ceil(SPAN_S * rate_hz), WINDOWS * window), VALUES_MAX // max(1, channels)))


@dataclass(frozen=True, eq=False)
class _Stream:
    """Channels and rate of consecutive samples, and how many of them are retained."""

    channels: tuple[Channel, ...]
    rate_hz: float
    most: int


class SignalTap:
    """The newest samples that an axis tracked.

    The thread that tracks calls `add`. Nothing is copied unless `watch` was called within `WATCHED_S`.
    """

    def __init__(self) -> None:
        self.spectra = False
        """Whether the source sends spectra instead of samples."""
        self._lock = threading.Lock()  # held for references only, never for a copy: the tracking thread waits for it
        self._parts: deque[tuple[int, NDArray[np.float64]]] = deque()
        self._stream: _Stream | None = None
        self._first, self._origin_s = 0, 0.0
        self._until_s = -math.inf
        self._window = 0
        self._named: tuple[Channel, ...] = ()

    def begin(self, channels: tuple[Channel, ...], window: int) -> None:
        """The channels of the next run with their units, and its window in samples."""
        with self._lock:
            self._named, self._window = channels, window
            self._stream, self._parts, self.spectra = None, deque(), False

    def watch(self) -> None:
        """Retain samples from now on; called again and again as long as they are of use."""
        self._until_s = time.monotonic() + WATCHED_S

    def add(self, block: Block, now_s: float) -> None:
        """Retain a copy of these samples, if somebody looks; `now_s` is `time.monotonic()`."""
        if now_s > self._until_s:
            if self._stream is not None:
                with self._lock:
                    self._stream, self._parts = None, deque()
            return
        if isinstance(block, Spectra):
            self.spectra = True
            return
        stream, stop = self._stream, block.stop
        again = bool(self._parts) and block.start < self._parts[-1][0]  # the source began again
        if stream is None or again or (block.channels, block.rate_hz) != (stream.channels, stream.rate_hz):
            most = span_samples(block.rate_hz, self._window, len(block.channels))
            stream = _Stream(block.channels, block.rate_hz, most)
        data = block.data[:, -stream.most :].copy()
        with self._lock:
            if stream is not self._stream:
                self._stream, self._parts, self._first = stream, deque(), stop - data.shape[1]
            self._origin_s = block.origin_s
            parts = self._parts
            parts.append((stop, data))
            while parts[0][0] <= stop - stream.most:
                parts.popleft()

    def newest(self) -> Block | None:
        """The newest samples as one Block, NaN where samples are missing; None if there are none yet."""
        with self._lock:
            stream, parts, first, named = self._stream, list(self._parts), self._first, self._named
            origin_s = self._origin_s
        if stream is None or not parts:
            return None
        stop = parts[-1][0]
        start = max(first, stop - stream.most)
        data = np.full((len(stream.channels), stop - start), np.nan)
        for end, part in parts:
            used = min(part.shape[1], end - start)
            data[:, end - start - used : end - start] = part[:, part.shape[1] - used :]
        same = tuple(c.name for c in named) == tuple(c.name for c in stream.channels)
        return Block(data, named if same else stream.channels, stream.rate_hz, start, origin_s)
