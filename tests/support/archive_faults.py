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

PROGRAM = str(Path(sys.executable).with_name("livebode"))
_LOOK_S, _LONGEST_S = 0.02, 300.0


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

    A kill is at a random moment after one more result was written, or before the first.
    """
    done: list[str] = []
    process = start(archive)
    for victim in kills:
        wanted = len(list((lake / "responses").glob("*.parquet"))) + int(rng.integers(0, 3))
        limit_s = time.monotonic() + _LONGEST_S
        while process.poll() is None and len(list((lake / "responses").glob("*.parquet"))) < wanted:
            assert time.monotonic() < limit_s
            time.sleep(_LOOK_S)
        time.sleep(rng.uniform(0, 0.5))
        if process.poll() is not None:
            break
        if victim == "coordinator":
            process.kill()
            process.communicate()
            process = start(archive)
            done.append(victim)
        elif workers := workers_of(process):
            kill(workers[rng.integers(len(workers))])
            done.append(victim)
    out, err = process.communicate(timeout=_LONGEST_S)
    assert process.returncode == 0, err
    return json.loads(out.splitlines()[-1]), done


def kill(process: psutil.Process) -> None:
    """Kill a process, unless it has just ended."""
    try:
        process.kill()
    except psutil.NoSuchProcess:
        return
