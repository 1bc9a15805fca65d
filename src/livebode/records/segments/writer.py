"""Writer: does the work of a record, beside its axis where tracking would otherwise wait for the disk.

Appending to a journal does not wait for a disk that answers, because the system writes it later. Threads for that take
the interpreter from the one that tracks: with 64 axes each of them needs twice the processor time then
(`python -m bench.hall`).
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from math import inf

_THREADS = 4  # a sync that takes long leaves room for other records; the work between syncs is little
_SLOW_S = 0.2  # a job that takes longer shows a disk that does not answer, or a start of many axes
_BESIDE_S, _BESIDE_S_MAX = 5.0, 600.0  # after such a job, all are done in threads for so long; twice that at the next


class Writer:
    """Does the jobs of one record in their order, in threads that all records of the process share, or at once."""

    def __init__(self) -> None:
        self._jobs: deque[Callable[[], None]] = deque()
        self._changed = threading.Condition()
        self._working = False
        self._error: BaseException | None = None

    @property
    def idle(self) -> bool:
        """Whether all jobs are done."""
        return not self._working

    def add(self, job: Callable[[], None], *, at_once: bool = False) -> None:
        """Do it after the previous ones; raises the exception with which one of them ended: none is done after it.

        `at_once`: do it in this thread, if no other one waits and the disks of the process have answered in time.
        """
        self.check()
        if at_once and self.idle and _at_once.do(partial(self._do, job)):
            return
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
            self._do(job)

    def _do(self, job: Callable[[], None]) -> None:
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


class _AtOnce:
    """Does jobs in the thread that asks, as long as none of them has taken long."""

    def __init__(self) -> None:
        self._free = threading.Lock()
        self._resumes_s, self._beside_s = -inf, _BESIDE_S

    def do(self, job: Callable[[], None]) -> bool:
        """Do it, or return False: the last slow one was a short time ago, or one has not returned."""
        began_s = time.monotonic()
        if began_s < self._resumes_s or not self._free.acquire(blocking=False):
            return False
        try:
            job()
        finally:
            ended_s = time.monotonic()
            if ended_s - began_s > _SLOW_S:
                self._resumes_s = ended_s + self._beside_s
                self._beside_s = min(2 * self._beside_s, _BESIDE_S_MAX)
            self._free.release()
        return True


_at_once = _AtOnce()


@cache
def _threads() -> ThreadPoolExecutor:
    """Not before the first job: a process that is forked has no threads of its parent."""
    return ThreadPoolExecutor(_THREADS, "livebode record")
