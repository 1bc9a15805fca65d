"""What the axes of one process cost and how much memory they need, for `bench.growth`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bench.growth_live import BATCH, Marks, run
from bench.monitoring_live import RATE_HZ

AXES = (1, 4, 16, 64)
SECONDS = 25.0
"""Of each machine's time; the newest responses that the dashboard retains are complete after that."""


@dataclass(frozen=True)
class Process:
    """A process with so many axes: milliseconds of processor time a second for all of them, and resident memory."""

    axes: int
    ms_per_s: float
    resident_mb: float


def measure(folder: Path, axes: int) -> Process:
    """Processor time of the second half, when all axes are at work, and the memory at the end."""
    batches = round(SECONDS * RATE_HZ / BATCH)
    marks = Marks(axes * 20)
    run(folder, axes, batches, marks)
    half = len(marks.cpu_s) // 2
    each_s = (marks.data_s[-1] - marks.data_s[half]) / axes
    return Process(axes, 1e3 * (marks.cpu_s[-1] - marks.cpu_s[half]) / each_s, marks.resident_mb[-1])
