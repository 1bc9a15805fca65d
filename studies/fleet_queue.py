"""Simulation of a worker of a fleet: messages arrive, are read in batches, tracked, and their results are stored.

One core computes for all partitions of the worker, in the order in which their reads return. A read returns what waits,
at most a batch; if nothing waits, it collects for a while. Results are stored with the first batch that ends after they
are due. Times are in seconds.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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
    batch: int = 64
    read_s: float = 0.1
    results_s: float = 0.5

    def slower(self, factor: float) -> WorkerCosts:
        """The same on a core that other programs use too."""
        times_s = (self.message_s * factor, self.batch_s * factor, self.store_s * factor)
        return WorkerCosts(*times_s, self.batch, self.read_s, self.results_s)


class _Partition:
    """Messages of a partition, those before `next` are tracked, those before `kept` are stored."""

    def __init__(self, arrivals: Floats, due_s: float) -> None:
        self.arrivals = arrivals
        self.stored = np.full(len(arrivals), np.nan)
        self.next = self.kept = 0
        self.due_s = due_s

    def returned(self, costs: WorkerCosts, now_s: float) -> float:
        """When a read that begins now returns."""
        if self.next < len(self.arrivals) and self.arrivals[self.next] <= now_s:
            return now_s
        full = self.next + costs.batch - 1
        full_s = self.arrivals[full] if full < len(self.arrivals) else np.inf
        return float(min(now_s + costs.read_s, full_s))


def stored_times(costs: WorkerCosts, partitions: Sequence[Floats], open_s: float = 0.0) -> list[Floats]:
    """When the result of each message is stored, for the ascending times of arrival in each partition.

    Nothing is read before `open_s`: what arrived until then waits, as after the death of the previous owner.
    """
    rng = np.random.default_rng(0)
    parts = [_Partition(arrivals, open_s + rng.uniform(0.0, costs.results_s)) for arrivals in partitions]
    reads = [(part.returned(costs, open_s), number) for number, part in enumerate(parts) if len(part.arrivals)]
    heapq.heapify(reads)
    free_s = open_s
    while reads:
        returned_s, number = heapq.heappop(reads)
        part = parts[number]
        arrived = int(np.searchsorted(part.arrivals, returned_s, side="right"))
        count = min(costs.batch, arrived - part.next)
        free_s = max(free_s, returned_s) + costs.batch_s + count * costs.message_s
        part.next += count
        if free_s >= part.due_s and part.kept < part.next:
            free_s += costs.store_s
            part.stored[part.kept : part.next] = free_s
            part.kept, part.due_s = part.next, free_s + costs.results_s
        if part.kept < len(part.arrivals):
            heapq.heappush(reads, (part.returned(costs, free_s), number))
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
