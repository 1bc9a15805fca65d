"""Process items on a cluster: in groups first, one by one where a worker ended, and alone where it ended again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from distributed import KilledWorker, as_completed, get_worker

from livebode.archive.clusters import Cluster
from livebode.archive.grouping import RecordingGroups, Sized

S = TypeVar("S", bound=Sized)
R = TypeVar("R")

_IN_FLIGHT = 2
_COUNT_AGAIN_S = 5.0


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
    """

    cluster: Cluster
    groups: RecordingGroups[S]
    together: Callable[[Sequence[S], Path], list[R]]
    alone: Callable[[S, Path], R]
    again: Callable[[R], bool]
    suspects: deque[S] = field(default_factory=deque)
    last: deque[S] = field(default_factory=deque)
    _tasks: dict[Any, tuple[list[S], bool]] = field(default_factory=dict)

    def results(self) -> Iterator[list[tuple[S, R]]]:
        """The items with their results, as they come."""
        done, counted_s, workers = as_completed(with_results=False, loop=self.cluster.client.loop), 0.0, 1
        while True:
            if time.monotonic() - counted_s > _COUNT_AGAIN_S:
                counted_s, workers = time.monotonic(), self.cluster.workers
            while len(self._tasks) < _IN_FLIGHT * workers and (task := self._next(workers)):
                future = self._submit(*task)
                self._tasks[future] = task
                done.add(future)
            if not self._tasks:
                return
            if found := self._taken(next(done)):
                yield found

    def ready(self) -> list[tuple[S, R]]:
        """The results that have arrived and were not given yet; the rest is dropped."""
        found = [pair for future in list(self._tasks) if future.status == "finished" for pair in self._taken(future)]
        self.cluster.client.cancel(list(self._tasks), force=True)
        self._tasks.clear()
        return found

    def _next(self, workers: int) -> tuple[list[S], bool] | None:
        """The next items, and whether each is processed alone."""
        if self.last:
            return [self.last.popleft()], True
        if self.suspects:
            return [self.suspects.popleft()], False
        return (self.groups.next(workers), False) if len(self.groups) else None

    def _submit(self, items: list[S], alone: bool) -> Any:
        submit = self.cluster.client.submit
        if alone:
            return submit(_in_scratch, self.alone, items[0], pure=False)
        return submit(_in_scratch, self.together, items, pure=False)

    def _taken(self, future: Any) -> list[tuple[S, R]]:
        """The final results of a task; what has none is tried again."""
        items, alone = self._tasks.pop(future)
        if future.status == "finished":
            results = [future.result()] if alone else future.result()
        elif isinstance(future.exception(), KilledWorker) or future.status in ("cancelled", "lost"):
            self._try_again(items, alone)
            return []
        else:
            raise future.exception()
        final = []
        for item, result in zip(items, results):
            if not alone and self.again(result):
                self.last.append(item)
            else:
                final.append((item, result))
        return final

    def _try_again(self, items: list[S], alone: bool) -> None:
        """The worker ended: by one of these items if they were processed, or by what it processed before them."""
        if alone or len(items) == 1:
            self.last.extend(items)
        else:
            self.suspects.extend(items)


def _in_scratch(task: Callable[[Any, Path], Any], items: Any) -> Any:
    """Run a task with the worker's own directory for temporary files: Dask removes that of a worker that was killed."""
    return task(items, Path(get_worker().local_directory))
