"""What a tracker costs with 7 to 401 lines, for `bench.growth`."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from livebode.core import Block, Lines
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine

COUNTS = (7, 21, 51, 101, 201, 401)
RATE_HZ, WINDOW, HOP, SECONDS, ROUNDS = 4000.0, 1000, 200, 10.0, 7
BLOCK = 400  # samples: 100 ms, two responses
NAMES = ("w", "u", "y")


@dataclass(frozen=True)
class Tracking:
    """So many lines: milliseconds of processor time per second of samples."""

    lines: int
    ms_per_s: float


def signals(lines: Lines) -> np.ndarray:
    """w, u and y of a delay, with noise."""
    rng = np.random.default_rng(0)
    w = np.resize(multisine(lines), round(SECONDS * RATE_HZ))
    u = w + 0.1 * rng.standard_normal(w.size)
    return np.array([w, u, np.roll(u, 3) + 0.1 * rng.standard_normal(w.size)])


def measure() -> list[Tracking]:
    """The least of several rounds, in which all numbers of lines take turns."""
    machines = {n: Lines(tuple(range(1, n + 1)), WINDOW, RATE_HZ) for n in COUNTS}
    data = {n: signals(lines) for n, lines in machines.items()}
    rounds = [[_round(lines, data[n]) for n, lines in machines.items()] for _ in range(ROUNDS)]
    return [Tracking(n, 1e3 * seconds / SECONDS) for n, seconds in zip(COUNTS, np.min(rounds, axis=0).tolist())]


def _round(lines: Lines, data: np.ndarray) -> float:
    """Seconds of processor time of a tracker, from samples to responses with bounds."""
    tracker = Tracker(Settings(lines=lines, output="y", input="u", excitation="w", hop=HOP))
    blocks = [Block(data[:, i : i + BLOCK], NAMES, RATE_HZ, start=i) for i in range(0, data.shape[1], BLOCK)]
    begun = time.thread_time()
    for block in blocks:
        tracker.process(block)
    return time.thread_time() - begun
