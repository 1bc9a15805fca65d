"""The work of every contender, and its timing."""

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
ROWS = 4096
HOP = 20
# (N, bins): a window of 100 has only 51 bins.
CELLS = [
    (window, list(range(1, count + 1) if count < window // 2 else range(count)))
    for window in (100, 200, 1000)
    for count in (7, 21, 51 if window == 100 else 101)
]


def signal(samples: int) -> Array:
    return np.random.default_rng(samples).standard_normal(samples)


def side_by_side(tasks: Mapping[str, Callable[[], object]], seconds: float) -> dict[str, float]:
    """Measure the best time of each, in seconds.

    They take turns, and it is the least wall time of many short calls: a neighbour interrupts some of them, while the
    clock of the processor time reads too little on a shared computer. A turn is a few calls in a row of which the first
    is not counted: each works on its own reused buffers, as in a loop that does nothing else.
    """
    best = dict.fromkeys(tasks, np.inf)
    calls = {}
    for name, task in tasks.items():
        task()
        started = time.perf_counter()
        task()
        calls[name] = max(2, int(500e-6 / max(time.perf_counter() - started, 1e-9)))
    end = time.perf_counter() + seconds * len(tasks)
    rounds = 0
    while time.perf_counter() < end or rounds < 2:
        rounds += 1
        for name, task in tasks.items():
            task()
            for _ in range(calls[name]):
                started = time.perf_counter()
                task()
                best[name] = min(best[name], time.perf_counter() - started)
    return best
