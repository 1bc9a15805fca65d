"""The recordings that commands are measured with: `python -m bench.job FOLDER` writes short and long.parquet."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bench.versions.scenarios import recording
from livebode.core import Lines
from livebode.excitation import multisine

RATE_HZ, SECONDS, WINDOW = 4000, 600, 400
FREQUENCIES = "20:220:10"
LINES = Lines.parse(FREQUENCIES, rate_hz=RATE_HZ, window=WINDOW)
BINS = list(LINES.bins)
NAMES = ("w", "u", "y")


def signals() -> np.ndarray:
    """w, u, y, shape (3, samples)."""
    rng = np.random.default_rng(0)
    w = np.resize(multisine(LINES), RATE_HZ * SECONDS)
    u = w + 0.1 * rng.standard_normal(w.size)
    return np.array([w, u, np.roll(u, 3) + 0.1 * rng.standard_normal(w.size)])


def write_logs(folder: Path) -> None:
    """Two seconds of an axis with a resonance, which a model can be fitted to, and ten minutes of a delay."""
    for name, data in (("short", recording(2.0)[: len(NAMES)]), ("long", signals())):
        table = pa.table(dict(zip(("w", "u [N m]", "y [rad/s]"), data)))
        pq.write_table(table.replace_schema_metadata({"rate_hz": str(RATE_HZ)}), folder / f"{name}.parquet")


def processor_s(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


if __name__ == "__main__":
    write_logs(Path(sys.argv[1]))
