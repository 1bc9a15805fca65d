"""Cost of reading recordings in a process of their own with limited memory: its start, and the samples' way back."""

from __future__ import annotations

import multiprocessing
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from statistics import median

import numpy as np

from livebode.core import Block
from livebode.sources import open_log
from livebode.tables import Table, write_parquet

ROUNDS, SAMPLES, RATE_HZ = 3, 10_000_000, 4000.0
SLOTS, MEMORY_BYTES = 2, 1 << 30
NAMES = ["u", "y"]


def blocks(path: Path) -> Iterator[Block]:
    """The samples of the recording."""
    return open_log(path, rate_hz=RATE_HZ).blocks(NAMES)


def serve(path: Path, memory: str, slot_bytes: int, way: Connection) -> None:
    """Copy block after block to shared memory; the other side returns each slot."""
    limit = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    shared = SharedMemory(memory)
    for number, block in enumerate(blocks(path)):
        if number >= SLOTS:
            way.recv()
        slot = number % SLOTS * slot_bytes
        np.ndarray(block.data.shape, np.float64, shared.buf, slot)[:] = block.data
        way.send((slot, block.data.shape))
    way.send(None)
    shared.close()


def read_through(method: str, path: Path, slot_bytes: int) -> tuple[float, float, int]:
    """Seconds until the first block, and until the end, and the samples."""
    context = multiprocessing.get_context(method)
    shared = SharedMemory(create=True, size=SLOTS * slot_bytes)
    own, other = context.Pipe()
    began = time.perf_counter()
    process = context.Process(target=serve, args=(path, shared.name, slot_bytes, other))
    process.start()
    first_s, samples = 0.0, 0
    while (found := own.recv()) is not None:
        first_s = first_s or time.perf_counter() - began
        slot, shape = found
        samples += np.ndarray(shape, np.float64, shared.buf, slot).copy().shape[1]
        with suppress(BrokenPipeError):  # after the last block
            own.send(None)
    whole_s = time.perf_counter() - began
    process.join()
    shared.close()
    shared.unlink()
    return first_s, whole_s, samples


def read_here(path: Path) -> tuple[float, float, int]:
    """The same in this process."""
    began, first_s, samples = time.perf_counter(), 0.0, 0
    for block in blocks(path):
        first_s = first_s or time.perf_counter() - began
        samples += block.data.copy().shape[1]
    return first_s, time.perf_counter() - began, samples


def main() -> None:
    """Measure, and print a table."""
    with tempfile.TemporaryDirectory() as folder:
        short, long = Path(folder, "short.parquet"), Path(folder, "long.parquet")
        rng = np.random.default_rng(1)
        for path, samples in ((short, 40_000), (long, SAMPLES)):
            write_parquet(path, Table.of({name: rng.standard_normal(samples) for name in NAMES}))
        slot_bytes = max(block.data.nbytes for block in blocks(long))
        code = "from livebode.sources import open_log; import pyarrow, h5py"
        for _ in range(2):
            began = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            imported_s = time.perf_counter() - began
        print(f"start of Python with the readers: {imported_s:.2f} s")
        preloaded = ["livebode.sources.opening", "livebode.sources.parquet"]
        multiprocessing.get_context("forkserver").set_forkserver_preload(preloaded)
        print("| read | first block of a short recording, s | long recording, s | MB/s |")
        for name in ("here", "forkserver, first", "forkserver", "fork", "spawn"):
            method = name.partition(",")[0]
            rounds = 1 if name.endswith("first") else ROUNDS
            found = [
                [
                    read_here(path) if name == "here" else read_through(method, path, slot_bytes)
                    for path in (short, long)
                ]
                for _ in range(rounds)
            ]
            first_s, long_s = (median(one[k][k] for one in found) for k in (0, 1))
            print(f"| {name} | {first_s:.3f} | {long_s:.2f} | {16 * SAMPLES / long_s / 1e6:.0f} |", flush=True)


if __name__ == "__main__":
    main()
