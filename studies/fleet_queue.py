"""Simulation of a worker of a fleet: messages arrive, are read in batches, tracked, and their results are stored.

One core computes for all partitions of the worker, in the order of their reads. A partition reads in its turn, at equal
intervals, and at once where a batch did not hold all that waited; the results of what was read are stored together.
Times are in seconds.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_GOLDEN = 0.618


@dataclass(frozen=True)
class WorkerCosts:
    """Service times and the owner's constants.

    Attributes
    ----------
    message_s
        Of tracking a message.
    batch_s
        Of a read, whatever it returns.
    store_s
        Of storing results, with states and all else that is not done for each message.
    """

    message_s: float
    batch_s: float = 0.0
    store_s: float = 0.0
    batch: int = 1024
    results_s: float = 0.4

    def slower(self, factor: float) -> WorkerCosts:
        """The same on a core that other programs use too."""
        times_s = (self.message_s * factor, self.batch_s * factor, self.store_s * factor)
        return WorkerCosts(*times_s, self.batch, self.results_s)


class _Partition:
    """Messages of a partition, stored up to `next`; it reads `turn_s` after each multiple of the interval."""

    def __init__(self, arrivals: Floats, turn_s: float) -> None:
        self.arrivals, self._turn_s = arrivals, turn_s
        self.stored = np.full(len(arrivals), np.nan)
        self.next = 0

    def read_s(self, costs: WorkerCosts, now_s: float, *, full: bool = False) -> float:
        """When it reads the next time, if there is something, after a read that was `full` or not."""
        earliest_s = max(now_s, float(self.arrivals[self.next]))
        if full or not costs.results_s:
            return earliest_s
        turns = np.ceil((earliest_s - self._turn_s) / costs.results_s)
        return float(turns * costs.results_s + self._turn_s)


def stored_times(costs: WorkerCosts, partitions: Sequence[Floats], open_s: float = 0.0) -> list[Floats]:
    """When the result of each message is stored, for the ascending times of arrival in each partition.

    Nothing is read before `open_s`: what arrived until then waits, as after the death of the previous owner.
    """
    parts = [_Partition(arrivals, number * _GOLDEN % 1 * costs.results_s) for number, arrivals in enumerate(partitions)]
    reads = [(part.read_s(costs, open_s), number) for number, part in enumerate(parts) if len(part.arrivals)]
    heapq.heapify(reads)
    free_s = open_s
    while reads:
        read_s, number = heapq.heappop(reads)
        part = parts[number]
        free_s = max(free_s, read_s)
        count = min(costs.batch, int(np.searchsorted(part.arrivals, free_s, side="right")) - part.next)
        free_s += costs.batch_s + count * costs.message_s + costs.store_s
        part.stored[part.next : part.next + count] = free_s
        part.next += count
        if part.next < len(part.arrivals):
            heapq.heappush(reads, (part.read_s(costs, free_s, full=count == costs.batch), number))
    return [part.stored for part in parts]


def arrivals(
    axes: int, partitions: int, period_s: float, seconds: float, *, jitter_s: float = 0.0, seed: int = 0
) -> list[Floats]:
    """When messages arrive in each partition: of axes with random phases, each late by up to a jitter."""
    rng = np.random.default_rng(seed)
    numbers = np.arange(round(seconds / period_s))
    found: list[list[Floats]] = [[] for _ in range(partitions)]
    for partition in rng.integers(partitions, size=axes):
        late_s = rng.uniform(0.0, jitter_s, len(numbers))
        found[partition].append((numbers + rng.uniform()) * period_s + late_s)
    return [np.sort(np.concatenate(times)) if times else np.zeros(0) for times in found]


def caught_up_s(load: float, waiting_s: float) -> float:
    """Closed form: time to compute what arrived in `waiting_s` while as much arrives as before; load below 1."""
    return waiting_s * load / (1 - load)
