"""What a live run costs at the age of an hour, a day, a month and a year, for `bench.growth`.

The machine sends half a second of samples, pauses, sends again, and so on; its clock is accelerated, so the pauses take
no time. Every pause is a loss of samples, hence an event and an alarm, and is followed by a new segment. After a year
the run has as many segments, events and alarms as one whose segments are four hours long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from bench.growth_live import BATCH, Marks, run
from bench.monitoring_live import RATE_HZ

HOUR_S, DAY_S, MONTH_S, YEAR_S = 3600.0, 86400.0, 30 * 86400.0, 365 * 86400.0
AGES_S = {"1 h": HOUR_S, "1 day": DAY_S, "1 month": MONTH_S, "1 year": YEAR_S}
STAGES = ((HOUR_S, 15.0), (DAY_S, 600.0), (MONTH_S, 7200.0), (YEAR_S, 14400.0))
"""Until this age, in seconds, one burst each so many seconds."""
BURST = 20  # batches
SEGMENT_S = 5.0  # less than each pause


@dataclass(frozen=True)
class Age:
    """A live run at one age: milliseconds of processor time for a second of samples, and resident memory."""

    age_s: float
    ms_per_s: float
    resident_mb: float


def begins(stages: Sequence[tuple[float, float]]) -> list[int]:
    """Number of the first sample of each burst."""
    found: list[int] = []
    for (from_s, _), (to_s, every_s) in pairwise(((0.0, 0.0), *stages)):
        found += [round(RATE_HZ * t) for t in np.arange(from_s, to_s, every_s)]
    return found


def measure(folder: Path, stages: Sequence[tuple[float, float]] = STAGES) -> list[Age]:
    """The ages of one run, spaced evenly in their logarithm: the mean of the bursts around each."""
    starts = begins(stages)
    marks = Marks(BURST)
    run(folder, 1, BURST * len(starts), marks, lambda n: starts[n // BURST] + n % BURST * BATCH, SEGMENT_S)
    age_s, ms = np.array(marks.age_s[1:]), 1e3 * np.diff(marks.cpu_s) / np.diff(marks.data_s)
    assert age_s[-1] > 0.9 * stages[-1][0]
    edges = np.geomspace(60.0, 1.001 * age_s[-1], 25)
    which = np.digitize(age_s, edges)
    groups = [np.flatnonzero(which == i) for i in range(1, len(edges))]
    return [
        Age(math.exp(np.mean(np.log(age_s[at]))), float(np.mean(ms[at])), marks.resident_mb[at[-1] + 1])
        for at in groups
        if at.size
    ]
