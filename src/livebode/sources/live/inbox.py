"""Inbox: batches that were received and not yet processed, in bounded memory."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from livebode.sources.live.spectra_batch import AnyBatch

INBOX_S_MAX = 60.0
"""Longest machine time in the queue: longer than any pause of a working tracker."""
INBOX_BYTES_MIN, INBOX_BYTES_MAX = 1 << 20, 64 << 20
"""Bytes that may always wait, and bytes that may never wait: many axes share one computer."""
RESUMES_AT = 0.75
"""A queue that was full accepts batches again when at most this share of it is used: dropped samples then form few long
spans, with complete windows between them."""
ON_DEMAND_S_MAX = 0.1
"""Longest machine time of a sender that waits anyway: samples that are still at the sender are not lost when this
process is killed."""
_ENTRY_BYTES = 1000


class _Entry(NamedTuple):
    batch: AnyBatch
    size_bytes: int
    seconds: float


class Inbox:
    """A queue of batches between the thread that receives and the one that tracks.

    A full one lets a sender wait that can, and rejects the batches of others.

    Parameters
    ----------
    bytes_max
        Most bytes in it.
    seconds_max
        Longest machine time in it, above `bytes_min`.
    bytes_min
        Bytes that may always wait; one batch may, too.
    """

    def __init__(
        self,
        bytes_max: int = INBOX_BYTES_MAX,
        *,
        seconds_max: float = INBOX_S_MAX,
        bytes_min: int = INBOX_BYTES_MIN,
    ) -> None:
        self._bytes_max, self._bytes_min, self._seconds_max = bytes_max, bytes_min, seconds_max
        self._batches: deque[_Entry] = deque()
        self._bytes = 0
        self._seconds = 0.0
        self._changed = threading.Condition()
        self._closed = False
        self._full = False
        self.listener: Callable[[], None] = lambda: None
        """Called when a batch was added and `enough_s` wait, or the queue was closed."""
        self.enough_s = 0.0

    @property
    def seconds(self) -> float:
        """Machine time in the queue."""
        return self._seconds

    @property
    def bytes(self) -> int:
        return self._bytes

    @property
    def has_enough(self) -> bool:
        """Whether batches of `enough_s` wait, and at least one."""
        return bool(self._batches) and self._seconds >= self.enough_s

    @property
    def ended(self) -> bool:
        """Whether the queue is empty and closed."""
        return self._closed and not self._batches  # nothing is added after it was closed

    def put(self, batch: AnyBatch, wait: bool) -> bool:
        """Whether it was accepted. A full inbox rejects batches until a quarter is free, or with `wait` waits."""
        entry = _Entry(batch, batch.nbytes + _ENTRY_BYTES, (batch.stop - batch.first_sample) / batch.rate_hz)
        with self._changed:
            if wait:
                self._changed.wait_for(lambda: self._closed or self._has_room(entry))
            self._full = not self._has_room(entry, RESUMES_AT if self._full else 1.0)
            if self._closed or self._full:
                return False
            self._batches.append(entry)
            self._bytes += entry.size_bytes
            self._seconds += entry.seconds
            self._changed.notify_all()
            enough = self.has_enough
        if enough:
            self.listener()
        return True

    def _has_room(self, entry: _Entry, share: float = 1.0) -> bool:
        size, seconds = self._bytes + entry.size_bytes, self._seconds + entry.seconds
        short = size <= share * self._bytes_min or seconds <= share * self._seconds_max
        return size <= share * self._bytes_max and (short or not self._batches)

    def _remove(self) -> AnyBatch:
        batch, size_bytes, seconds = self._batches.popleft()
        self._bytes -= size_bytes
        self._seconds = self._seconds - seconds if self._batches else 0.0  # no rounding error remains
        return batch

    def wait(self, timeout_s: float) -> bool:
        """Whether a batch waits, or arrived in time."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._batches, timeout_s)
            return bool(self._batches)

    def get(self, timeout_s: float) -> AnyBatch | None:
        """The oldest batch; None if none arrived in time or the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._batches, timeout_s)
            if not self._batches:
                return None
            batch = self._remove()
            self._changed.notify_all()
            return batch

    def get_waiting(self, samples_max: int) -> list[AnyBatch]:
        """The oldest batches that wait, with at most so many samples together, or one; none if none waits."""
        taken: list[AnyBatch] = []
        with self._changed:
            while self._batches and (not taken or self._batches[0].batch.samples <= samples_max):
                batch = self._remove()
                samples_max -= batch.samples
                taken.append(batch)
            if taken:
                self._changed.notify_all()
        return taken

    def close(self) -> None:
        """Close the queue; its contents can still be read."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self.listener()
