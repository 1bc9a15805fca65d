"""`python -m bench.start`: what the command line costs before it does anything, in the cost of Python's own start.

Processor time, user and system, of a child process; the median of 20, the programs in turn. The other rows have no
target: they tell what a shell waits for at a completion, and what any command pays for Typer, Rich, NumPy and Arrow.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
from pathlib import Path

LIVEBODE = str(Path(sys.executable).with_name("livebode"))
TARGET = 3.0
ROUNDS = 20
PYTHON = "python -c pass"
COMPLETION = {"_LIVEBODE_COMPLETE": "complete_bash", "COMP_WORDS": "livebode ", "COMP_CWORD": "1"}
PROGRAMS: dict[str, tuple[list[str], dict[str, str]]] = {
    PYTHON: ([sys.executable, "-c", "pass"], {}),
    "livebode --version": ([LIVEBODE, "--version"], {}),
    "livebode --help": ([LIVEBODE, "--help"], {}),
    "completion of a command": ([LIVEBODE], COMPLETION),
    "livebode run --help": ([LIVEBODE, "run", "--help"], {}),
    "python -c 'import rich.console, typer'": ([sys.executable, "-c", "import rich.console, typer"], {}),
}
WITH_TARGET = ("livebode --version", "livebode --help")


def processor_s(command: list[str], extra: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=os.environ | extra, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    times: dict[str, list[float]] = {name: [] for name in PROGRAMS}
    for _ in range(ROUNDS):
        for name, program in PROGRAMS.items():
            times[name].append(processor_s(*program))
    medians = {name: statistics.median(values) for name, values in times.items()}
    for name, median in medians.items():
        ratio = median / medians[PYTHON]
        verdict = f"   target ≤ {TARGET:g} ×: {'met' if ratio <= TARGET else 'missed'}" if name in WITH_TARGET else ""
        print(f"{name:40}{1e3 * median:8.1f} ms{ratio:7.1f} ×{verdict}")


if __name__ == "__main__":
    main()
