"""A year in one run directory: 5,000 segments of 1 h 45 min, by an accelerated clock.

`python -m bench.segments` records runs of 500 and 5,000 segments, each with 30 responses at the bench's lines. It opens
each of them, reads and queries an hour, shows it until the first page has answered (view), and computes the trend of
its middle half (half). Each is in a process of its own: wall time, processor time, and growth of the peak of memory,
without the start of Python and the imports above; the least of three. The target is 0.5 s, and memory that is
independent of the length. `--segments 500 5000 20000` records others, `--plain` without merging and without means, as
earlier versions did.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import duckdb  # noqa: F401  # so that its import does not count
import numpy as np

from bench.job import LINES
from livebode.core import Responses
from livebode.dashboard import Dashboard, Past, ServerSettings
from livebode.records import RESPONSES, RunRecord, SegmentLimits, Store, Thinning, as_batch, query
from livebode.records.segments import shelf

SEGMENT_S, RESPONSES_EACH, TARGET_S = 6307.2, 30, 0.5
HOP = round(SEGMENT_S / RESPONSES_EACH * LINES.rate_hz)
FOUND = {
    "bins": list(LINES.bins), "window": LINES.window, "rate_hz": LINES.rate_hz, "quiet_bins": list(LINES.quiet),
    "hop": HOP, "quantity": "plant", "unit": "",
}  # fmt: skip
HOUR_S = 1_000_000, 1_003_600
SQL = f"SELECT count(*), avg(re) FROM responses WHERE time_s BETWEEN {HOUR_S[0]} AND {HOUR_S[1]}"
RESULTS = "open", "between", "query", "view", "half"


def recorded(path: Path, segments: int, *, plain: bool) -> None:
    """Record so many segments through the store itself."""
    rng, each = np.random.default_rng(0), round(SEGMENT_S * LINES.rate_hz)
    if plain:
        shelf.Shelf.merge = shelf.Shelf.shorten = lambda *_: None  # type: ignore[method-assign]
    tiers = shelf.no_tiers if plain else Thinning(FOUND).tables
    summary = {"configuration": {}, "found": FOUND}
    with Store(path, {"responses": RESPONSES}, SegmentLimits(1, each), tiers=tiers) as store:
        store.begin(summary, 0, 0.0, {})
        for number in range(segments):
            store.write("responses", as_batch(_responses(rng, number * each)))
            store.commit((number + 1) * each, (number + 1) * SEGMENT_S, {})
        store.finish(summary, {}, finished=True)


def _responses(rng: np.random.Generator, begin: int) -> Responses:
    shape = RESPONSES_EACH, len(LINES)
    sample = begin + (np.arange(RESPONSES_EACH) + 1) * HOP - 1
    noise = rng.standard_normal((*shape, 2)).view(np.complex128)[..., 0]
    return Responses(
        lines=LINES, value=1 + 0.1 * noise, sigma=np.full(shape, 0.14), dof=np.full(RESPONSES_EACH, 8.0),
        coherence=np.full(shape, 0.9), valid=np.ones(shape, dtype=bool), first=sample - LINES.window + 1,
        sample=sample, time_s=(sample - LINES.window / 2) / LINES.rate_hz, schedule=np.zeros(RESPONSES_EACH),
        quantity="plant", unit="",
    )  # fmt: skip


def opened(path: Path) -> None:
    RunRecord.open(path)


def between(path: Path) -> None:
    assert sum(len(part) for part in RunRecord.open(path).between(*HOUR_S))


def queried(path: Path) -> None:
    assert query(RunRecord.open(path), SQL, 10).rows[0][0]


def viewed(path: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(path)
    with dashboard, urllib.request.urlopen(dashboard.url) as page:
        page.read()


def half_a_year(path: Path) -> None:
    """What the page asks for when a person zooms to the middle half of the run."""
    run = RunRecord.open(path)
    found = [segment for segment in run.segments if segment.table == "responses"]
    begin, end = found[0].first_s, found[-1].last_s
    past = Past(path, None, next(run.between(begin, begin)), begin, end, True, ())
    assert len(past.between(begin + (end - begin) / 4, end - (end - begin) / 4, 1200))


WORK: dict[str, Callable[[Path], None]] = dict(zip(RESULTS, (opened, between, queried, viewed, half_a_year)))


def measured(what: str, path: Path) -> None:
    """One piece of work in this process; prints wall time, processor time and growth of the peak of memory."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    processor_s, wall_s = time.process_time(), time.perf_counter()
    WORK[what](path)
    spent = time.perf_counter() - wall_s, time.process_time() - processor_s
    print(json.dumps([*spent, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024]))


def child(*arguments: str) -> str:
    command = [sys.executable, "-m", "bench.segments", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, nargs="+", default=[500, 5000])
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--measure", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        measured(options.measure[0], Path(options.measure[1]))
        return
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        for segments in options.segments:
            path = Path(folder) / str(segments)
            recorded(path, segments, plain=options.plain)
            files = sum(len(list(one.iterdir())) for one in path.glob("responses*"))
            print(f"{segments} segments, {segments * SEGMENT_S / 86400:.0f} days, in {files} files")
            for what in RESULTS:
                found = min(json.loads(child("--measure", what, str(path))) for _ in range(3))
                verdict = "met" if found[0] <= TARGET_S else "missed"
                print(
                    f"  {what:8} {found[0]:6.3f} s wall, {found[1]:6.3f} s processor, {found[2]:4.0f} MiB more; "
                    f"target {TARGET_S} s: {verdict}"
                )


if __name__ == "__main__":
    main()
