"""Programs as a user starts them, and what they cost."""

from __future__ import annotations

import os
import resource
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path


class Processes:
    """Runs programs with bytecode, which an installed package has; their processor and wall time, and their output."""

    def __init__(self, bytecode: Path) -> None:
        self._environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        self._environment["PYTHONPYCACHEPREFIX"] = str(bytecode)

    def run(
        self, *command: str, environment: Mapping[str, str] | None = None, code: int = 0
    ) -> tuple[float, float, str]:
        """Seconds of processor time, user and system, seconds on the wall, and the standard output."""
        before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run(
            command, env=self._environment | dict(environment or {}), check=False, capture_output=True, text=True
        )
        wall_s, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode != code:
            raise SystemExit(f"{command} ended with {done.returncode}: {done.stderr}")
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall_s, done.stdout
