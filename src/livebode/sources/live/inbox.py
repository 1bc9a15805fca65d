"""Inbox: what was received and not yet looked at, in bounded memory."""

from __future__ import annotations

import threading
from collections import deque

from livebode.sources.live.spectra_batch import AnyBatch

INBOX_S_MAX = 60.0
"""The machine's time that may wait: longer than any pause of a tracker that works."""
INBOX_BYTES_MIN, INBOX_BYTES_MAX = 1 << 20, 64 << 20
"""What may wait however long it is, and what may not however short: many axes share one computer."""
RESUMES_AT = 0.75
"""A queue that was full takes batches again when no more than this share of it is used: what is dropped is in few long
spans, and the windows between them are whole."""
WAITING_S_MAX = 0.1
"""The same where the sender can wait: what it still has is not lost when this process is killed."""
_ENTRY_BYTES = 1000


class Inbox:
    """A queue of batches between the thread that receives and the one that tracks: at most 60 s of them, and 64 MiB.

    Where the sender waits, at most 0.1 s, or one batch.
    """

    def __init__(self, bytes_max: int = INBOX_BYTES_MAX, *, waits: bool = False) -> None:
        self._bytes_max = bytes_max
        self._bytes_min, self._seconds_max = (0, WAITING_S_MAX) if waits else (INBOX_BYTES_MIN, INBOX_S_MAX)
        self._batches: deque[AnyBatch] = deque()
        self._bytes = 0
        self._seconds = 0.0
        self._changed = threading.Condition()
        self._closed = False
        self._full = False

    @property
    def seconds(self) -> float:
        """The machine's time that waits."""
        return self._seconds

    @property
    def bytes(self) -> int:
        return self._bytes

    @property
    def ended(self) -> bool:
        """Whether nothing is in it and nothing more will come."""
        with self._changed:
            return self._closed and not self._batches

    def put(self, batch: AnyBatch, wait: bool) -> bool:
        """Whether the batch was taken. A full inbox refuses it and those behind it until a quarter is free, or with
        `wait` lets the sender wait.
        """
        with self._changed:
            if wait:
                self._changed.wait_for(lambda: self._closed or self._has_room(batch))
            self._full = not self._has_room(batch, RESUMES_AT if self._full else 1.0)
            if self._closed or self._full:
                return False
            self._batches.append(batch)
            self._count(batch, 1)
            return True

    def _has_room(self, batch: AnyBatch, share: float = 1.0) -> bool:
        size, seconds = self._bytes + _size_bytes(batch), self._seconds + _seconds(batch)
        short = size <= share * self._bytes_min or seconds <= share * self._seconds_max
        return size <= share * self._bytes_max and (short or not self._batches)

    def _count(self, batch: AnyBatch, sign: int) -> None:
        self._bytes += sign * _size_bytes(batch)
        self._seconds = self._seconds + sign * _seconds(batch) if self._batches else 0.0  # no rounding stays
        self._changed.notify_all()

    def get(self, timeout_s: float) -> AnyBatch | None:
        """The oldest batch; None where none came in time or none will come."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._batches, timeout_s)
            if not self._batches:
                return None
            batch = self._batches.popleft()
            self._count(batch, -1)
            return batch

    def close(self) -> None:
        """Nothing more will come; what is in it can still be had."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


def _size_bytes(batch: AnyBatch) -> int:
    return batch.nbytes + _ENTRY_BYTES


def _seconds(batch: AnyBatch) -> float:
    return (batch.stop - batch.first_sample) / batch.rate_hz
