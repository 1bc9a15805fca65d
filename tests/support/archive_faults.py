"""An archive in a process of its own, of which workers and the coordinator are killed."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import numpy as np
import psutil

from tests.support.forked import Command
from tests.support.peers.peer import PATIENCE_S

_LOOK_S = 0.02
_WITHOUT_WORKERS = "has had no worker"


class ArchiveProcess:
    """`livebode archive run` in a process of its own, which is started again when it was killed; a context manager."""

    def __init__(self, archive: Path, lake: Path) -> None:
        self._archive, self._responses = archive, lake / "tables" / "responses"
        self._started = ExitStack()

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._started.close()

    def _start(self) -> None:
        self._process = self._started.enter_context(Command("archive", "run", self._archive, "--json"))

    def restart(self) -> None:
        """Kill the coordinator, and start another one."""
        self._process.kill()
        self._process.wait()
        self._start()

    @property
    def ended(self) -> bool:
        return self._process.poll() is not None

    @property
    def workers(self) -> list[psutil.Process]:
        """The processes of its workers, and those in which recordings are tracked alone."""
        try:
            children = psutil.Process(self._process.pid).children(recursive=True)
            return [child for child in children if "resource_tracker" not in " ".join(child.cmdline())]
        except psutil.Error:
            return []

    def wait_for_results(self, more: int) -> None:
        """Wait for so many more results, or the end; one that writes none for too long is started again."""
        wanted = self._results() + more
        limit_s = time.monotonic() + PATIENCE_S
        while not self.ended and self._results() < wanted:
            if time.monotonic() > limit_s:
                self.restart()
                return
            time.sleep(_LOOK_S)

    def _results(self) -> int:
        return len(list(self._responses.glob("*.parquet")))

    def result(self) -> Any:
        """What it prints at its end; a run that has lost all workers is started again."""
        while True:
            try:
                out, err = self._process.communicate(timeout=PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.restart()
                continue
            if self._process.returncode == 0:
                return json.loads(out.splitlines()[-1])
            assert _WITHOUT_WORKERS in err.decode(), err
            self._start()


def run_with_kills(archive: Path, lake: Path, kills: Sequence[str], rng: np.random.Generator) -> tuple[Any, list[str]]:
    """Run an archive to its end while a "worker" or the "coordinator" is killed; its last result, and what was killed.

    A kill is at a random moment after one more result was written, or before the first. A run that has lost all workers
    is started again: what starts a worker gives up if that is killed while it starts.
    """
    done: list[str] = []
    with ArchiveProcess(archive, lake) as process:
        for victim in kills:
            process.wait_for_results(int(rng.integers(0, 3)))
            time.sleep(rng.uniform(0, 0.5))
            if process.ended:
                break
            if victim == "coordinator":
                process.restart()
                done.append(victim)
            elif workers := process.workers:
                kill(workers[rng.integers(len(workers))])
                done.append(victim)
        return process.result(), done


def kill(process: psutil.Process) -> None:
    """Kill a process, unless it has just ended."""
    try:
        process.kill()
    except psutil.NoSuchProcess:
        return
