"""An archive in a process of its own, of which workers and the coordinator are killed."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from tests.support.peers.peer import PATIENCE_S

PROGRAM = str(Path(sys.executable).with_name("livebode"))
_LOOK_S = 0.02
_WITHOUT_WORKERS = "has had no worker"


def start(archive: Path) -> subprocess.Popen[str]:
    """`livebode archive run` in a process of its own."""
    return subprocess.Popen(
        [PROGRAM, "archive", "run", str(archive), "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """The processes of its workers, and those in which recordings are tracked alone."""
    try:
        children = psutil.Process(process.pid).children(recursive=True)
        return [child for child in children if "resource_tracker" not in " ".join(child.cmdline())]
    except psutil.Error:
        return []


def run_with_kills(archive: Path, lake: Path, kills: Sequence[str], rng: np.random.Generator) -> tuple[Any, list[str]]:
    """Run an archive to its end while a "worker" or the "coordinator" is killed; its last result, and what was killed.

    A kill is at a random moment after one more result was written, or before the first. A run that has lost all workers
    is started again: what starts a worker gives up if that is killed while it starts.
    """
    done: list[str] = []
    process = start(archive)
    for victim in kills:
        if not _wrote(process, lake, int(rng.integers(0, 3))):
            process = _restarted(process, archive)
        time.sleep(rng.uniform(0, 0.5))
        if process.poll() is not None:
            break
        if victim == "coordinator":
            process = _restarted(process, archive)
            done.append(victim)
        elif workers := workers_of(process):
            kill(workers[rng.integers(len(workers))])
            done.append(victim)
    while True:
        try:
            out, err = process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            process = _restarted(process, archive)
            continue
        if process.returncode == 0:
            return json.loads(out.splitlines()[-1]), done
        assert _WITHOUT_WORKERS in err, err
        process = start(archive)


def _wrote(process: subprocess.Popen[str], lake: Path, more: int) -> bool:
    """Wait for more results, or the end; whether one of them came."""
    wanted = len(list((lake / "tables" / "responses").glob("*.parquet"))) + more
    limit_s = time.monotonic() + PATIENCE_S
    while process.poll() is None and len(list((lake / "tables" / "responses").glob("*.parquet"))) < wanted:
        if time.monotonic() > limit_s:
            return False
        time.sleep(_LOOK_S)
    return True


def _restarted(process: subprocess.Popen[str], archive: Path) -> subprocess.Popen[str]:
    process.kill()
    process.communicate()
    return start(archive)


def kill(process: psutil.Process) -> None:
    """Kill a process, unless it has just ended."""
    try:
        process.kill()
    except psutil.NoSuchProcess:
        return
