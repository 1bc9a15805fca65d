"""Syncing: a journal is synced in a separate thread, so that tracking does not wait for the disk."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

from livebode.records.segments.disk import AppendFile


class Syncing:
    """One sync at a time, in a separate thread; its result is available on request."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "livebode syncing")
        self._running: Future[None] | None = None
        self._upto = (0, 0)

    def begin(self, file: AppendFile, parts: int) -> None:
        """Sync the file in its present state, with so many parts written to it, if no other sync is running."""
        if self._running is None:
            self._upto = file.length, parts
            self._running = self._thread.submit(file.sync)

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
        """End the thread."""
        self._thread.shutdown()
