"""Programs as a user starts them, functions in new processes, and what they cost."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple, TypeVar

T = TypeVar("T")


class Cost(NamedTuple):
    """What a program cost: user and system time, wall time, the largest resident memory, and its standard output."""

    processor_s: float
    wall_s: float
    peak_mib: float
    output: str


class Processes:
    """Runs programs with bytecode in this directory, which an installed package has."""

    def __init__(self, bytecode: Path) -> None:
        self._environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        self._environment["PYTHONPYCACHEPREFIX"] = str(bytecode)

    def run(self, *command: str, environment: Mapping[str, str] | None = None, codes: Collection[int] = (0,)) -> Cost:
        """Run a program until it ends with one of these codes.

        Its memory is at least that which this process had when it started the program.
        """
        begun = time.perf_counter()
        with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
            process = subprocess.Popen(
                command, env=self._environment | dict(environment or {}), stdout=output, stderr=errors
            )
            _, status, usage = os.wait4(process.pid, 0)
            wall_s, process.returncode = time.perf_counter() - begun, os.waitstatus_to_exitcode(status)
            for file in (output, errors):
                file.seek(0)
            if process.returncode not in codes:
                raise SystemExit(f"{command} ended with {process.returncode}: {errors.read()}")
            return Cost(usage.ru_utime + usage.ru_stime, wall_s, usage.ru_maxrss / 1024, output.read())

    def least(self, rounds: int, *command: str, codes: Collection[int] = (0,)) -> Cost:
        """The least times and memory of several runs."""
        costs = [self.run(*command, codes=codes) for _ in range(rounds)]
        wall_s, peak_mib = (min(getattr(cost, name) for cost in costs) for name in ("wall_s", "peak_mib"))
        return min(costs)._replace(wall_s=wall_s, peak_mib=peak_mib)


def apart(work: Callable[..., T], *arguments: object) -> T:
    """The result of a function in a new process."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(work, *arguments).result()
