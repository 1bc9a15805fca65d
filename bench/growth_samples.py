"""What a recording of a minute to an hour costs and how much memory it needs, for `bench.growth`."""

from __future__ import annotations

import resource
import time
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from bench.job import LINES, RATE_HZ, WINDOW, signals
from livebode.configuration import Axis
from livebode.runtime import Destination, run

MINUTES = (1, 4, 15, 60)
HOP = 200


@dataclass(frozen=True)
class Recording:
    """A recording of so many minutes: processor time in seconds, and the largest resident memory in MB."""

    minutes: float
    cpu_s: float
    peak_mb: float


def write(path: Path, minutes: int) -> None:
    """A recording of three channels at 4 kHz, in row groups of a minute."""
    data = signals()[:, : round(60 * RATE_HZ)]
    minute = pa.table(dict(zip(("w", "u", "y"), data))).replace_schema_metadata({"rate_hz": str(RATE_HZ)})
    with pq.ParquetWriter(path, minute.schema) as writer:
        for _ in range(minutes):
            writer.write_table(minute)


def measure(folder: Path, minutes: int) -> Recording:
    """Track a recording as `livebode run` does, with its record and without pictures."""
    axis = Axis.of(
        {
            "source": {"log": str(folder / f"{minutes}.parquet")},
            "signals": {"excitation": "w", "input": "u", "output": "y"},
            "lines": {"frequencies": ",".join(f"k={k}" for k in LINES.bins), "window": WINDOW},
            "tracking": {"hop": HOP},
        },
        "growth",
    )
    begun = time.process_time()
    run(axis, Destination(folder / f"run-{minutes}", lambda *_: None))
    cpu_s, peak = time.process_time() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return Recording(minutes, cpu_s, peak * 1024 / 1e6)
