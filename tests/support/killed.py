"""Processes that record as fast as they can, and are killed with signal 9 at a random moment."""

from __future__ import annotations

import contextlib
import signal
import time
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import numpy as np

from tests.support.command import RATE_HZ
from tests.support.forked import server
from tests.support.recorded import check_beginning, check_whole, machine, record_machine, unfinished

SAMPLES = 8_000


def start(directory: Path) -> tuple[ForkServerProcess, Connection]:
    """A process that records, and the numbers of samples that it says are tracked."""
    context = server()
    results, outlet = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(directory, outlet))
    process.start()
    outlet.close()
    return process, results


def _work(directory: Path, outlet: Connection) -> None:
    outlet.send(0)
    record_machine(machine(SAMPLES), directory, progress=lambda done, _: outlet.send(done))


def run_s(directory: Path) -> float:
    """How long a process records that nobody kills, from its first word on."""
    process, results = start(directory)
    results.recv()
    began = time.perf_counter()
    process.join()
    check_whole(directory, SAMPLES)
    return time.perf_counter() - began


def kill_often(directory: Path, whole_s: float, rng: np.random.Generator) -> int:
    """Kill processes that record in this directory until one finishes or three were killed, and check after each.

    Returns how many were killed.
    """
    tracked = kills = 0
    for _ in range(3):
        process, results = start(directory)
        results.recv()
        time.sleep(rng.uniform(0, whole_s))
        process.kill()
        process.join()
        tracked = max([tracked, *_received(results)])
        if (directory / "run.json").exists():
            check_beginning(directory, SAMPLES, tracked - RATE_HZ)
        else:
            assert tracked == 0
        assert process.exitcode in (0, -signal.SIGKILL)
        kills += process.exitcode != 0
        if not unfinished(directory):
            break
    else:
        record_machine(machine(SAMPLES), directory)
    check_whole(directory, SAMPLES)
    return kills


def _received(results: Connection) -> list[int]:
    found = []
    with results, contextlib.suppress(EOFError):
        while True:
            found.append(results.recv())
    return found
