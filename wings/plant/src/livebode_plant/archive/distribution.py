"""Distribution: items on a cluster, in groups first, one by one where a worker ended, alone where it ended again."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Generic, Protocol, TypeVar

from distributed import KilledWorker, get_worker
from distributed.client import ClosedClientError, FutureCancelledError

from livebode.core import ArchiveError
from livebode.dataclass import dataclass
from livebode_plant.archive.clusters import Cluster

_GROUP_S = (0.2, 10.0)
_PER_WORKER = 4


class SizedItem(Protocol):
    """What is processed: its length and nothing else is known before."""

    @property
    def size_bytes(self) -> int: ...


S = TypeVar("S", bound=SizedItem)


class RecordingGroups(Generic[S]):
    """What waits to be processed, in groups whose expected time shrinks towards the end.

    A group has at most a quarter of the time that remains for each worker, between 0.2 and 10 s: so a worker has at
    least four groups where there is enough to do, the overhead of a task is small, and the end is balanced. The time
    is proportional to the size, with the factor of what was processed so far; until then a group has one item.

    Parameters
    ----------
    items
        In the order in which they are processed: the longest first.
    """

    def __init__(self, items: Iterable[S]) -> None:
        self._waiting = deque(items)
        self._bytes = sum(map(_size, self._waiting))
        self._done_s = self._done_bytes = 0.0

    def __len__(self) -> int:
        return len(self._waiting)

    def learn(self, size_bytes: int, seconds: float) -> None:
        """Take the time of an item that was processed."""
        self._done_s += seconds
        self._done_bytes += max(size_bytes, 1)

    def next(self, workers: int) -> list[S]:
        """The next group."""
        remaining_s = self._seconds(self._bytes)
        target_s = min(max(remaining_s / (_PER_WORKER * workers), _GROUP_S[0]), _GROUP_S[1])
        group: list[S] = []
        group_s = 0.0
        while self._waiting and (not group or (self._done_s and group_s < target_s)):
            group.append(self._waiting.popleft())
            group_s += self._seconds(_size(group[-1]))
            self._bytes -= _size(group[-1])
        return group

    def _seconds(self, size_bytes: float) -> float:
        return size_bytes * self._done_s / self._done_bytes if self._done_bytes else 0.0


def _size(item: SizedItem) -> int:
    return max(item.size_bytes, 1)


R = TypeVar("R")

_IN_FLIGHT = 2
_COUNT_AGAIN_S = 5.0
_NO_WORKER_S = 120.0
_ALONE_MAX = 3


@dataclass
class Distribution(Generic[S, R]):
    """Items on their way through a cluster.

    A worker that ends takes the group that it processed and the one that waited there with it. Their items are tried
    again one by one, and what ends a worker also then, or fails, alone in a process of its own. So a recording that
    ends its process costs no other one more than time.

    Parameters
    ----------
    cluster
        Where they are processed.
    groups
        The items that are processed in groups.
    together
        Processes a group on a worker.
    alone
        Processes one item in a process of its own; its result is final.
    again
        Whether a result is a failure that is tried alone.
    lost
        The result of an item that has lost its worker three times while it was alone.
    """

    cluster: Cluster
    groups: RecordingGroups[S]
    together: Callable[[Sequence[S], Path], list[R]]
    alone: Callable[[S, Path], R]
    again: Callable[[R], bool]
    lost: Callable[[S], R]
    suspects: deque[S] = field(default_factory=deque)
    last: deque[S] = field(default_factory=deque)
    _tasks: dict[Any, tuple[list[S], bool]] = field(default_factory=dict)
    _arrived: SimpleQueue[Any] = field(default_factory=SimpleQueue)
    _lost_alone: Counter[S] = field(default_factory=Counter)

    def results(self) -> Iterator[list[tuple[S, R]]]:
        """The items with their results, as they come.

        Raises
        ------
        ArchiveError
            If the scheduler does not answer any more, or there has been no worker for two minutes.
        """
        counted_s, present_s, workers = 0.0, time.monotonic(), 1
        while True:
            if (now_s := time.monotonic()) - counted_s > _COUNT_AGAIN_S:
                if self.cluster.client.status == "closed":
                    raise _cluster_lost()
                counted_s, workers = now_s, self.cluster.workers
                present_s = now_s if workers else present_s
                _check_present(now_s - present_s)
            while len(self._tasks) < _IN_FLIGHT * max(workers, 1) and (task := self._next(max(workers, 1))):
                self._expect(self._submit(*task), task)
            if not self._tasks:
                return
            try:
                future = self._arrived.get(timeout=_COUNT_AGAIN_S)
            except Empty:
                continue
            if pairs := self._taken(future):
                yield pairs

    def ready(self) -> list[tuple[S, R]]:
        """The results that have arrived and were not given yet; the rest is dropped."""
        results = [pair for future in list(self._tasks) if future.status == "finished" for pair in self._taken(future)]
        self.cluster.client.cancel(list(self._tasks), force=True)
        self._tasks.clear()
        return results

    def _expect(self, future: Any, task: tuple[list[S], bool]) -> None:
        self._tasks[future] = task
        future.add_done_callback(self._arrived.put)

    def _next(self, workers: int) -> tuple[list[S], bool] | None:
        """The next items, and whether each is processed alone."""
        if self.last:
            return [self.last.popleft()], True
        if self.suspects:
            return [self.suspects.popleft()], False
        return (self.groups.next(workers), False) if len(self.groups) else None

    def _submit(self, items: list[S], alone: bool) -> Any:
        task, argument = (self.alone, items[0]) if alone else (self.together, items)
        try:
            return self.cluster.client.submit(_in_scratch, task, argument, pure=False)
        except ClosedClientError:
            raise _cluster_lost() from None

    def _taken(self, future: Any) -> list[tuple[S, R]]:
        """The final results of a task; what has none is tried again."""
        items, alone = task = self._tasks.pop(future)
        if future.status == "error" and not isinstance(future.exception(), KilledWorker):
            raise future.exception()
        if future.status not in ("finished", "pending"):
            return self._try_again(items, alone)
        try:
            handled = future.result(timeout=_COUNT_AGAIN_S)
        except TimeoutError:  # it was on a worker that was lost since then, and is computed again
            self._expect(future, task)
            return []
        except (KilledWorker, FutureCancelledError):
            return self._try_again(items, alone)
        results = [handled] if alone else handled
        final = []
        for item, result in zip(items, results):
            if not alone and self.again(result):
                self.last.append(item)
            else:
                final.append((item, result))
        return final

    def _try_again(self, items: list[S], alone: bool) -> list[tuple[S, R]]:
        """The worker ended: by one of these items if they were processed, or by what it processed before them."""
        if not alone and len(items) > 1:
            self.suspects.extend(items)
            return []
        self._lost_alone.update(items if alone else ())
        given_up = [item for item in items if self._lost_alone[item] == _ALONE_MAX]
        self.last.extend(item for item in items if item not in given_up)
        return [(item, self.lost(item)) for item in given_up]


_CONTINUE = "start the cluster again; the same command continues"


def _cluster_lost() -> ArchiveError:
    return ArchiveError("cluster-lost", "the scheduler of the cluster does not answer any more", _CONTINUE)


def _check_present(without_worker_s: float) -> None:
    if without_worker_s > _NO_WORKER_S:
        raise ArchiveError("workers-lost", f"the cluster has had no worker for {without_worker_s:.0f} s", _CONTINUE)


def _in_scratch(task: Callable[[Any, Path], Any], items: Any) -> Any:
    """Run a task with the worker's own directory for temporary files: Dask removes that of a worker that was killed."""
    return task(items, Path(get_worker().local_directory))
