"""Writer: does the work of a record beside its axis, so that tracking does not wait for the disk."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

_THREADS = 4  # a sync that takes long leaves room for other records; the work between syncs is little


class Writer:
    """Does the jobs of one record in their order, in threads that all records of the process share."""

    def __init__(self) -> None:
        self._jobs: deque[Callable[[], None]] = deque()
        self._changed = threading.Condition()
        self._working = False
        self._error: BaseException | None = None

    @property
    def idle(self) -> bool:
        """Whether all jobs are done."""
        return not self._working

    def add(self, job: Callable[[], None]) -> None:
        """Do it after the previous ones; raises the exception with which one of them ended: none is done after it."""
        self.check()
        with self._changed:
            self._jobs.append(job)
            if self._working:
                return
            self._working = True
        _threads().submit(self._work)

    def wait(self) -> None:
        """Wait until all jobs are done."""
        with self._changed:
            self._changed.wait_for(lambda: self.idle)

    def check(self) -> None:
        """Raise the exception with which a job ended."""
        if self._error is not None:
            raise self._error

    def _work(self) -> None:
        while (job := self._next()) is not None:
            try:
                job()
            except BaseException as error:  # it must not be lost with the thread
                self._error = error

    def _next(self) -> Callable[[], None] | None:
        with self._changed:
            if self._jobs and self._error is None:
                return self._jobs.popleft()
            self._jobs.clear()
            self._working = False
            self._changed.notify_all()
            return None


@cache
def _threads() -> ThreadPoolExecutor:
    """Not before the first job: a process that is forked has no threads of its parent."""
    return ThreadPoolExecutor(_THREADS, "livebode record")
