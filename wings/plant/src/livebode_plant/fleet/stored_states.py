"""StoredStates: when the state of each axis of a partition is stored again."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

STATE_S_MIN = 2.0
"""Least time between two states of an axis."""
STATE_SHARE = 0.08
"""Most bytes of states, as a share of the bytes of the machines' data, while the replay is short enough."""
REPLAY_S_MAX = 3.0
"""Most computing time that a takeover of the partition repeats."""


@dataclass
class _Axis:
    """What came since the last state: bytes of the machine, and what it cost to compute."""

    size_bytes: int = 0
    since_bytes: int = 0
    since_s: float = 0.0
    stored_s: float = float("-inf")

    def rested(self, now_s: float) -> bool:
        return self.since_bytes > 0 and now_s - self.stored_s >= STATE_S_MIN


class StoredStates:
    """Decides by two rules. A takeover computes again what came since the last state of each axis.

    - A state is due when the data since then are so many times as large that states are `STATE_SHARE` of the bytes. A
      large state is stored less often.
    - If what a takeover would compute again takes longer than `REPLAY_S_MAX` for all axes together, those with most of
      it are due before that, whatever the size of their states.

    Parameters
    ----------
    clock
        Seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._axes: dict[str, _Axis] = {}

    @property
    def replay_s(self) -> float:
        """Computing time that a takeover would repeat now."""
        return sum(axis.since_s for axis in self._axes.values())

    def took(self, key: str, size_bytes: int, computed_s: float) -> None:
        """A message of an axis was processed."""
        axis = self._axes.get(key)
        if axis is None:
            axis = self._axes[key] = _Axis()
        axis.since_bytes += size_bytes
        axis.since_s += computed_s

    def restored(self, key: str, size_bytes: int) -> None:
        """The axis continues from a state of this size."""
        self._axes[key] = _Axis(size_bytes)

    def stored(self, key: str, size_bytes: int) -> None:
        """The state of an axis was stored."""
        self._axes[key] = _Axis(size_bytes, stored_s=self._clock())

    def due(self) -> list[str]:
        """The axes whose state is to be stored now."""
        now_s = self._clock()
        rested = {key: axis for key, axis in self._axes.items() if axis.rested(now_s)}
        found = [key for key, axis in rested.items() if STATE_SHARE * axis.since_bytes >= axis.size_bytes]
        return found + list(self._too_long(rested, set(found)))

    def _too_long(self, rested: dict[str, _Axis], found: set[str]) -> Iterator[str]:
        left_s = self.replay_s - sum(rested[key].since_s for key in found)
        for key in sorted(rested.keys() - found, key=lambda key: rested[key].since_s, reverse=True):
            if left_s <= REPLAY_S_MAX:
                return
            left_s -= rested[key].since_s
            yield key
