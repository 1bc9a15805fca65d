"""Groups of recordings as tasks, by the seconds that are expected: long ones last, so that no worker waits for one."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Generic, Protocol, TypeVar

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
