"""`python -m bench.start`: what the command line costs before it does anything, in the cost of Python's own start.

Processor time, user and system, of a child process with bytecode, as installed; the median of 20, the programs in
turn. The other rows have no target: they tell what a shell waits for at a completion, and what any command pays for
Typer, Rich, NumPy and Arrow.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

from bench.processes import Processes

LIVEBODE = str(Path(sys.executable).with_name("livebode"))
TARGET = 3.0
ROUNDS = 20
PYTHON = "python -c pass"
COMPLETION = {"_LIVEBODE_COMPLETE": "complete_bash", "COMP_WORDS": "livebode ", "COMP_CWORD": "1"}
PROGRAMS: dict[str, tuple[list[str], dict[str, str], int]] = {
    PYTHON: ([sys.executable, "-c", "pass"], {}, 0),
    "livebode --version": ([LIVEBODE, "--version"], {}, 0),
    "livebode --help": ([LIVEBODE, "--help"], {}, 0),
    "completion of a command": ([LIVEBODE], COMPLETION, 0),
    "livebode rn (a wrong command)": ([LIVEBODE, "rn"], {}, 2),
    "livebode run --help": ([LIVEBODE, "run", "--help"], {}, 0),
    "python -c 'import rich.console, typer'": ([sys.executable, "-c", "import rich.console, typer"], {}, 0),
}
WITH_TARGET = ("livebode --version", "livebode --help")


def main() -> None:
    times: dict[str, list[float]] = {name: [] for name in PROGRAMS}
    with tempfile.TemporaryDirectory() as folder:
        processes = Processes(Path(folder))
        for _ in range(ROUNDS + 1):  # the first writes the bytecode
            for name, (command, environment, code) in PROGRAMS.items():
                times[name].append(processes.run(*command, environment=environment, code=code)[0])
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    for name, median in medians.items():
        ratio = median / medians[PYTHON]
        verdict = f"   target ≤ {TARGET:g} ×: {'met' if ratio <= TARGET else 'missed'}" if name in WITH_TARGET else ""
        print(f"{name:40}{1e3 * median:8.1f} ms{ratio:7.1f} ×{verdict}")


if __name__ == "__main__":
    main()
