"""Syncing: a journal is synced in a separate thread, so that the next commit does not wait for the disk."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache

from livebode.records.segments.disk import AppendFile

_THREADS = 4


class Syncing:
    """One sync at a time, in threads that all records of the process share; its result is available on request."""

    def __init__(self) -> None:
        self._running: Future[None] | None = None
        self._upto = (0, 0)

    def begin(self, file: AppendFile, parts: int) -> None:
        """Sync the file in its present state, with so many parts written to it, if no other sync is running."""
        if self._running is None:
            self._upto = file.length, parts
            self._running = _threads().submit(file.sync)

    def done(self, *, wait: bool = False) -> tuple[int, int] | None:
        """Length and parts that are safe since the last call; None if no sync has ended.

        Raises
        ------
        OSError
            If the sync failed.
        """
        if self._running is None or not (wait or self._running.done()):
            return None
        running, self._running = self._running, None
        running.result()
        return self._upto

    def close(self) -> None:
        """Wait for the end of a sync, and ignore its result."""
        if self._running is not None:
            wait([self._running])


@cache
def _threads() -> ThreadPoolExecutor:
    """Not before the first sync: a process that is forked has no threads of its parent."""
    return ThreadPoolExecutor(_THREADS, "livebode syncing")
