"""An archive on Dask, compared with a process pool and a loop; 10,000 known files; memory of a worker.

    python -m bench.archive [worker] [speed] [known] [memory]

worker: processor time of a worker for each recording of 10 s, the least of several rounds, with one thread for BLAS.
speed: the same recordings of several lengths, with and without a fit, tracked by a simple loop, by a pool of two
processes (`multiprocessing`, one task for each recording) and by two workers of Dask as `livebode archive run` uses
them, in turn. All start with warm processes and commit their results to a lake. The ratios are medians over rounds.
The last column is twice the ratio of the processor times: what two free cores would give if none of them ever waited.
known: `livebode archive run` in a process of its own where the lake knows each of 10,000 files.
memory: the largest resident memory of the worker that tracks recordings of growing length. The load of the computer is
printed, because other work changes all of it.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.pool import Pool
from pathlib import Path

import numpy as np
import psutil
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from livebode.configuration import Axis
from livebode.core import Lines
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
from livebode_plant.archive.alone import handle_alone
from livebode_plant.archive.archive_settings import ArchiveSettings, ClusterSection, Template
from livebode_plant.archive.archived_recordings import (
    ArchivedRecording,
    RecordingPlace,
    RecordingResults,
    TrackedResult,
    each_result,
    file_rows,
    find_places,
    longest_first,
    lost,
)
from livebode_plant.archive.clusters import Cluster, started
from livebode_plant.archive.coordinator import Committer
from livebode_plant.archive.distribution import Distribution, RecordingGroups
from livebode_plant.archive.tasks import Job, handle, handle_one
from livebode_plant.lake import TABLES, Lake

WORKERS, RATE_HZ, WINDOW = 2, 4000.0, 400
POOL_RATIO_MAX, LOOP_RATIO_MIN, KNOWN_S_MAX, MEMORY_MB_MAX = 1.05, 1.9, 5.0, 300
KNOWN = 10_000
WORKER_RECORDINGS, WORKER_ROUNDS, WORKER_MS_MAX = 6, 8, 20.0
PROGRAM = str(Path(sys.executable).with_name("livebode"))
LENGTHS = ((2.0, 160), (10.0, 60), (40.0, 30))
"""Seconds of a recording, and the number of recordings."""
MEMORY_S = (60.0, 600.0, 1800.0)
CONFIGURATION = {
    "signals": {"excitation": "w", "input": "u", "output": "velocity", "schedule": "x"},
    "lines": {"frequencies": "20:140:20", "window": WINDOW},
    "tracking": {"hop": 40},
}
FIT = {"fit": {"model": "two-mass", "radius_m": 0.019}}


def write_recording(path: Path, seconds: float, seed: int) -> None:
    """A recording of a belt axis that moves: four seconds of its simulation, repeated, with other noise each."""
    lines = Lines.parse("20:140:20", RATE_HZ, WINDOW)
    rng = np.random.default_rng(seed)
    axis = BeltAxis(excitation_n_m=multisine(lines, 0.3), motion=Strokes(), run_in_s=0.5, seconds=4.0)
    block, _ = SimulatedAxis(axis).run()
    names = [channel.name for channel in block.channels]
    with pq.ParquetWriter(path, pa.schema([(name, pa.float64()) for name in ("t", *names)])) as file:
        rows, each = round(seconds * RATE_HZ), block.data.shape[1]
        for first in range(0, rows, each):
            noise = 1 + 1e-3 * rng.standard_normal(block.data.shape)
            data = (block.data * noise)[:, : rows - first]
            t = (first + np.arange(data.shape[1])) / RATE_HZ
            file.write_table(pa.table([pa.array(t), *map(pa.array, data)], schema=file.schema))


@dataclass(frozen=True)
class Cost:
    """Wall time and processor time, s."""

    wall_s: float
    processor_s: float


def job_of(lake: Path, fit: bool) -> Job:
    """The recipe with or without a fit."""
    axis = Axis.of(CONFIGURATION | {"source": {"log": "recording"}} | (FIT if fit else {}), "bench")
    return Job.of({"": axis}, str(lake), 2_000_000_000)


def timed(job: Job, results: Callable[[], Iterable[RecordingResults]], recordings: int) -> Cost:
    """Costs until all results are in the lake."""
    committer = Committer(Lake(job.lake), job)
    began, before_s = time.perf_counter(), processor_s()
    found = each_result(results())
    committer.add(found)
    committer.commit()
    cost = Cost(time.perf_counter() - began, processor_s() - before_s)
    assert sum(isinstance(one, TrackedResult) for one in found) == recordings, found[:2]
    return cost


def processor_s() -> float:
    """Processor time of this process and all that it started."""
    own = psutil.Process()
    return sum(sum(one.cpu_times()[:2]) for one in (own, *own.children(recursive=True)))


def by_dask(cluster: Cluster, job: Job, recordings: list[ArchivedRecording]) -> Iterator[RecordingResults]:
    """As the coordinator does it."""
    groups = RecordingGroups(recordings)
    work: Distribution[ArchivedRecording, RecordingResults] = Distribution(
        cluster, groups, partial(handle, job), partial(handle_alone, job), lambda _: False, lost
    )
    for pairs in work.results():
        for recording, handled in pairs:
            groups.learn(recording.size_bytes, handled.seconds)
            yield handled


def worker_ms(folder: Path) -> float:
    """Milliseconds of processor time for a recording of 10 s, as a worker handles it."""
    own = folder / "worker"
    own.mkdir()
    for number in range(WORKER_RECORDINGS):
        write_recording(own / f"{number}.parquet", 10.0, number)
    job, found = job_of(own / "lake", False), []
    for turn in range(WORKER_ROUNDS):
        for place in find_places([Template(f"{own}/*.parquet")]):
            os.utime(place.url, ns=(turn, turn))  # a file that has changed is hashed again
            begun = time.process_time()
            results = handle_one(job, ArchivedRecording(place, tuple(job.recipes))).results
            found.append(time.process_time() - begun)
            assert isinstance(results[-1], TrackedResult), results
    return 1e3 * min(found)


def worker(folder: Path) -> None:
    """Print it."""
    ms = worker_ms(folder)
    print(f"a recording of 10 s: {ms:.1f} ms, {'met' if ms <= WORKER_MS_MAX else 'missed'} (≤ {WORKER_MS_MAX:g} ms)")


def speed(folder: Path, rounds: int) -> None:
    """Print the ratios for each length, without and with a fit."""
    processes = multiprocessing.get_context("spawn").Pool(WORKERS)
    with processes as pool:
        before_s = processor_s()
        with started(ClusterSection(workers=WORKERS, memory_mb=2000)) as cluster:
            print(f"two workers of Dask start in {processor_s() - before_s:.1f} s of processor time", flush=True)
            _print_lengths(folder, rounds, pool, cluster)


def _print_lengths(folder: Path, rounds: int, pool: Pool, cluster: Cluster) -> None:
    names = f"{'recording':>10} {'fit':>4} {'loop':>8} {'pool':>8} {'Dask':>8} {'Dask/pool':>10} {'loop/Dask':>10}"
    print(f"{names} {'on free cores':>13}")
    for seconds, count in LENGTHS:
        own = folder / f"{seconds:g}"
        own.mkdir()
        for number in range(count):
            write_recording(own / f"{number}.parquet", seconds, number)
        places = find_places([Template(f"{own}/*.parquet")])
        for fit in (False, True):
            recipes = tuple(job_of(own, fit).recipes)
            recordings = longest_first(ArchivedRecording(place, recipes) for place in places)
            ways: dict[str, Callable[[Job], Iterable[RecordingResults]]] = {
                "loop": lambda job, all_=recordings: (handle_one(job, one) for one in all_),
                "pool": lambda job, all_=recordings: pool.imap_unordered(partial(handle_one, job), all_),
                "dask": lambda job, all_=recordings: by_dask(cluster, job, all_),
            }
            found: dict[str, list[Cost]] = {name: [] for name in ways}
            for turn in range(rounds + 1):  # the first warms the processes
                for name, way in ways.items():
                    job = job_of(folder / f"lake-{seconds:g}-{fit}-{turn}-{name}", fit)
                    once = timed(job, partial(way, job), count)
                    found[name] += [once] if turn else []
            _print_speed(seconds, fit, found)


def _print_speed(seconds: float, fit: bool, found: dict[str, list[Cost]]) -> None:
    loop, pool, dask = found.values()
    to_pool = statistics.median(d.wall_s / p.wall_s for d, p in zip(dask, pool))
    to_loop = statistics.median(one.wall_s / d.wall_s for one, d in zip(loop, dask))
    at_most = statistics.median(WORKERS * one.processor_s / d.processor_s for one, d in zip(loop, dask))
    times = " ".join(f"{statistics.median(one.wall_s for one in way):7.2f}s" for way in (loop, pool, dask))
    met = "met" if to_pool <= POOL_RATIO_MAX and to_loop >= LOOP_RATIO_MIN else "missed"
    row = f"{seconds:8.0f} s {'yes' if fit else 'no':>4} {times} {to_pool:10.2f} {to_loop:10.2f} {at_most:13.2f}"
    print(f"{row}  {met}", flush=True)


def known(folder: Path) -> None:
    """Print the seconds of `livebode archive run` with nothing to do."""
    plant = folder / "plant"
    plant.mkdir()
    for number in range(KNOWN):
        (plant / f"{number:05}.csv").write_text(f"{number}\n")
    (folder / "recipe.toml").write_text('[signals]\noutput = "y"\n')
    archive = folder / "archive.toml"
    archive.write_text('inputs = ["plant/*.csv"]\nrecipe = "recipe.toml"\nlake = "lake"\n')
    settings = ArchiveSettings.read(archive)
    lake = Lake(settings.lake)
    (recipe,) = Job.of(settings.axes(), settings.lake, 1).recipes
    contents: list[tuple[RecordingPlace, str]] = [
        (place, f"{number:064x}") for number, place in enumerate(find_places(settings.templates))
    ]
    lake.add_rows("files", file_rows(contents, {}))
    for first in range(0, KNOWN, 100):  # as an archive commits them, so that the lake has many small files
        rows = [{"content": content, "recipe": recipe} for _, content in contents[first : first + 100]]
        lake.add_rows("runs", pa.Table.from_pylist(rows, schema=TABLES["runs"].schema))
    program = [PROGRAM, "archive", "run", str(archive)]
    times = []
    for _ in range(3):
        began = time.perf_counter()
        printed = subprocess.run(program, check=True, capture_output=True, text=True).stdout
        times.append(time.perf_counter() - began)
        assert f"{KNOWN:,} known, 0 tracked" in printed, printed
    took = statistics.median(times)
    print(f"{KNOWN:,} known files: {took:.1f} s, {'met' if took <= KNOWN_S_MAX else 'missed'} (≤ {KNOWN_S_MAX:g} s)")


def memory(folder: Path) -> None:
    """Print the peak of a worker's resident memory by the length of the recording, each in a new archive."""
    for seconds in MEMORY_S:
        own = folder / f"{seconds:g}"
        own.mkdir()
        write_recording(own / "log.parquet", seconds, 1)
        (own / "recipe.toml").write_text(tomli_w.dumps(CONFIGURATION))
        (own / "archive.toml").write_text(
            'inputs = ["log.parquet"]\nrecipe = "recipe.toml"\nlake = "lake"\n'
            "[cluster]\nworkers = 1\nmemory_mb = 2000\n"
        )
        began = time.perf_counter()
        peak, printed = _peak_mb([PROGRAM, "archive", "run", str(own / "archive.toml")])
        took = time.perf_counter() - began
        assert "1 tracked" in printed, printed
        verdict = "met" if peak <= MEMORY_MB_MAX else "missed"
        size = f"{(own / 'log.parquet').stat().st_size / 1e6:.0f} MB"
        print(f"recording of {seconds:.0f} s ({size}): worker {peak:.0f} MB, {verdict}; {took:.1f} s", flush=True)


def _peak_mb(program: list[str]) -> tuple[float, str]:
    """The largest resident memory of a process that this program starts, in MB, and what the program prints."""
    peak = 0
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        while process.poll() is None:
            with suppress(psutil.Error):
                workers = psutil.Process(process.pid).children(recursive=True)
                peak = max(peak, *(worker.memory_info().rss for worker in workers), 0)
            time.sleep(0.02)
        assert process.stdout
        return peak / 1e6, process.stdout.read()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=["worker", "speed", "known", "memory"])
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    parts = {"worker": worker, "speed": partial(speed, rounds=given.rounds), "known": known, "memory": memory}
    for name in given.parts:
        with tempfile.TemporaryDirectory() as folder:
            parts[name](Path(folder))
    print(f"load: {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
