"""Delay of a command on a run with very many segments: 5,000 of one second each.

`python -m bench.segments` records such a run, opens it as `query`, `view` and a command that continues it do, and
compares each with reading the same rows from one Parquet file.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.dataset as ds
import pyarrow.parquet as pq

from bench.job import LINES
from bench.record import NAMES, tracker_at
from livebode.analysis.overview import Overview
from livebode.configuration.record_section import RecordSection
from livebode.core import Block, Channel
from livebode.preparation.checks import ChannelCheck
from livebode.records import RunRecord
from livebode.records.query import query
from livebode.runtime.run_counts import RunCounts
from livebode.runtime.segmented import SegmentedRecord

SEGMENTS, RATE_HZ, HOP = 5000, 4000.0, 400
FOUND = {
    "bins": LINES.bins, "window": LINES.window, "rate_hz": LINES.rate_hz, "quiet_bins": LINES.quiet,
    "quantity": "plant", "unit": "",
}  # fmt: skip
SQL = "SELECT count(*), avg(re) FROM responses"


def opened(path: Path) -> SegmentedRecord:
    tracker = tracker_at(HOP)
    return SegmentedRecord(
        path, RecordSection(segment_s=1.0), summary={"configuration": {}, "found": FOUND},
        channels=[Channel(name) for name in NAMES], rate_hz=RATE_HZ,
        parts={"tracker": tracker, "counts": RunCounts(ChannelCheck(NAMES, "w"), time.perf_counter())},
        force=False, again=False, ends=lambda: False, publish=lambda _: None,
    )  # fmt: skip


def recorded(path: Path, segments: int) -> None:
    """Create a run with this number of segments that was killed."""
    data = np.random.default_rng(0).standard_normal((len(NAMES), round(RATE_HZ)))
    tracker = tracker_at(HOP)
    with opened(path) as run:
        blocks = (Block(data, NAMES, RATE_HZ, start=i * data.shape[1]) for i in range(segments))
        for block in blocks:
            run.take(tracker.process(block))
            run.commit(block)


def seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def continued(path: Path) -> None:
    with opened(path) as run:
        for part in run.previous():
            len(part)


def viewed(path: Path) -> None:
    overview = Overview()
    for part in RunRecord.open(path).batches():
        overview.add(part)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path, whole = Path(folder) / "run", Path(folder) / "whole.parquet"
        recorded(path, SEGMENTS)
        pq.write_table(ds.dataset(sorted((path / "responses").glob("*.parquet"))).to_table(), whole)
        print(f"{len(list((path / 'responses').iterdir()))} segments, {pq.read_metadata(whole).num_rows} rows")
        for name, work in {
            "the rows from one Parquet file": lambda: pq.read_table(whole),
            "Run.open": lambda: RunRecord.open(path),
            "query": lambda: query(RunRecord.open(path), SQL, 10),
            "view": lambda: viewed(path),
            "continue": lambda: continued(path),
        }.items():
            print(f"{name:32} {seconds(work):6.2f} s first, {seconds(work):6.2f} s again")


if __name__ == "__main__":
    main()
