"""Inbox: what was received and not yet looked at, in bounded memory."""

from __future__ import annotations

import threading
from collections import deque

from livebode.sources.live.spectra_batch import AnyBatch

INBOX_BYTES_MAX = 64 << 20
_ENTRY_BYTES = 1000


class Inbox:
    """A queue of batches between the thread that receives and the one that tracks; at most 64 MiB."""

    def __init__(self, bytes_max: int = INBOX_BYTES_MAX) -> None:
        self._bytes_max = bytes_max
        self._batches: deque[AnyBatch] = deque()
        self._bytes = 0
        self._changed = threading.Condition()
        self._closed = False

    @property
    def bytes(self) -> int:
        return self._bytes

    @property
    def ended(self) -> bool:
        """Whether nothing is in it and nothing more will come."""
        with self._changed:
            return self._closed and not self._batches

    def put(self, batch: AnyBatch, wait: bool) -> bool:
        """Whether the batch was taken. A full inbox refuses it, or with `wait` lets the sender wait."""
        size = batch.nbytes + _ENTRY_BYTES
        with self._changed:
            if wait:
                self._changed.wait_for(lambda: self._closed or self._bytes + size <= self._bytes_max)
            if self._closed or self._bytes + size > self._bytes_max:
                return False
            self._batches.append(batch)
            self._bytes += size
            self._changed.notify_all()
            return True

    def get(self, timeout_s: float) -> AnyBatch | None:
        """The oldest batch; None where none came in time or none will come."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._batches, timeout_s)
            if not self._batches:
                return None
            batch = self._batches.popleft()
            self._bytes -= batch.nbytes + _ENTRY_BYTES
            self._changed.notify_all()
            return batch

    def close(self) -> None:
        """Nothing more will come; what is in it can still be had."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
