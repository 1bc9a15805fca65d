"""Cost of the estimators for an excitation that does not repeat, beside a Tracker on the same samples.

`python -m bench.nonperiodic` prints the processor time of "lpm" and "welch" at 20 responses per second, per response
and as a ratio to the Tracker at the same window, lines and hop.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from livebode.core import Block, Lines
from livebode.estimation import NonPeriodicTracker, Settings, Tracker
from livebode.excitation import multisine

RATE_HZ, SECONDS, TURNS = 4000.0, 40, 3
LINES = (
    Lines.parse("20:140:20", RATE_HZ, 400),
    Lines.parse("20:140:5", RATE_HZ, 4000),
    Lines.parse("20:500:2", RATE_HZ, 16000),
)
HOP = 200  # 20 responses per second


def _tracking(lines: Lines, estimator: str) -> Callable[[], int]:
    w = np.resize(multisine(lines), int(SECONDS * RATE_HZ))
    y = w + 0.1 * np.random.default_rng(0).standard_normal(w.size)
    settings = Settings(lines=lines, output="y", input="u", excitation="w", hop=HOP, estimator=estimator)
    block = Block(np.array([w, w, y]), ("w", "u", "y"), RATE_HZ)
    kind = Tracker if settings.periodic else NonPeriodicTracker
    return lambda: len(kind(settings).process(block))


def _processor_s(work: Callable[[], object]) -> float:
    began = time.thread_time()
    work()
    return time.thread_time() - began


def main() -> None:
    for lines in LINES:
        works = {name: _tracking(lines, name) for name in ("joint", "lpm", "welch")}
        taken = dict.fromkeys(works, np.inf)
        for _ in range(TURNS):
            for name, work in works.items():
                taken[name] = min(taken[name], _processor_s(work))
        print(f"N = {lines.window}, {len(lines)} lines, 20 responses per second:")
        for name in ("lpm", "welch"):
            ratio, share = taken[name] / taken["joint"], taken[name] / SECONDS
            per = taken[name] / (SECONDS * RATE_HZ / HOP)
            print(f"  {name}: {per * 1e6:.0f} µs per response, {share:.2%} of a core, {ratio:.1f} × the Tracker")


if __name__ == "__main__":
    main()
