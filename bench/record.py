"""Cost of a record in segments compared with its tracker: 16 axes at the same time, and the stored snapshots.

Each axis has 21 lines in a window of 400 at 4 kHz, 20 responses per second, in blocks of 0.25 s as from a machine. One
axis is measured; its processor time counts 16 times.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from bench.job import LINES, RATE_HZ, WINDOW, processor_s, signals
from livebode.configuration import RecordSection
from livebode.core import Block, Channel
from livebode.estimation import Settings, Tracker
from livebode.preparation import ChannelCheck
from livebode.records import RESPONSE_TABLES
from livebode.runtime.run_counts import RunCounts
from livebode.runtime.segmented import SegmentedRecord

AXES, SECONDS, HOP = 16, 600, 200
NAMES = ("w", "u", "y")
TARGET = 0.05


def tracker_at(hop: int) -> Tracker:
    return Tracker(Settings(lines=LINES, excitation="w", input="u", output="y", hop=hop))


def measure() -> dict[str, float]:
    """Cost of the record by content, and of snapshots at three hops."""
    data, found = signals()[:, : SECONDS * RATE_HZ], {}
    for hop in (1, 20, 200):
        tracker = tracker_at(hop)
        tracker.process(Block(data[:, : 4 * WINDOW], NAMES, RATE_HZ))
        found[f"snapshot at hop {hop}, kB"] = len(tracker.snapshot()) / 1e3
        found[f"snapshot at hop {hop}, ms"] = 1e3 * min(processor_s(tracker.snapshot) for _ in range(20))
    for label, samples in (("responses", False), ("with samples", True)):
        recording_s, tracking_s, pause_s, left = record(data, samples)
        found |= {
            f"{label}: share of one core for {AXES} axes": AXES * recording_s / SECONDS,
            f"{label}: share of the tracker": AXES * tracking_s / SECONDS,
            f"{label}: longest pause of one axis, ms": 1e3 * pause_s,
            f"{label}: kB/s written to the disk by one axis": left / SECONDS / 1e3,
        }
    return found


def record(data: np.ndarray, samples: bool) -> tuple[float, float, float, int]:
    """Processor seconds of the record and of the tracker, the record's longest pause, and the bytes written."""
    tracker, counts = tracker_at(HOP), RunCounts(ChannelCheck(NAMES, "w"), time.perf_counter())
    tracking_s = pause_s = 0.0
    with tempfile.TemporaryDirectory() as folder:
        run = SegmentedRecord(
            Path(folder) / "run", RecordSection(samples=samples), tables=RESPONSE_TABLES,
            summary={"configuration": {}, "found": {}},
            channels=[Channel(name) for name in NAMES], rate_hz=RATE_HZ, parts={"tracker": tracker, "counts": counts},
            force=False, again=True, ends=lambda: True, publish=print,
        )  # fmt: skip
        size = RATE_HZ // 4
        blocks = (Block(data[:, i : i + size], NAMES, RATE_HZ, start=i) for i in range(0, data.shape[1], size))
        with run as out:
            began, began_cpu = time.perf_counter(), time.process_time()  # of all threads, with those that write
            for block in blocks:
                out.write_samples(block)
                pause_s = max(pause_s, time.perf_counter() - began)
                own_s = time.thread_time()
                responses = tracker.process(block)
                tracking_s += time.thread_time() - own_s
                began = time.perf_counter()
                out.take(responses)
                out.commit(block)
            out.commit_last()
            recording_s = time.process_time() - began_cpu - tracking_s
            out.finish({}, lambda _: None)
        left = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    return recording_s, tracking_s, pause_s, left


def report(result: dict[str, float]) -> None:
    print(f"a record in segments, {len(LINES)} lines, window {WINDOW}, {RATE_HZ // HOP} responses per second")
    for label, value in result.items():
        print(f"{label:60}{value:12.4g}")
    for label in ("responses", "with samples"):
        share = result[f"{label}: share of one core for {AXES} axes"]
        print(f"target ≤ {TARGET:g} of one core, {label}: {share:.3f} ({'met' if share <= TARGET else 'missed'})")
