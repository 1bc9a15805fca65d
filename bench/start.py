"""`python -m bench.start`: what the command line costs before it does anything, in the cost of Python's own start.

Processor time, user and system, of a child process with bytecode, as installed; the median of 20, the programs in
turn. What prints help or an error, or completes, loads Typer and nothing else that is large; Typer alone is the bound
of these rows. A wrong value costs more: Typer converts it by pydantic. `python -m bench.felt commands` has the
commands at work.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

from bench.processes import Processes

LIVEBODE = str(Path(sys.executable).with_name("livebode"))
ROUNDS = 20
PYTHON = "python -c pass"
COMMAND = {"_LIVEBODE_COMPLETE": "complete_bash", "COMP_WORDS": "livebode ", "COMP_CWORD": "1"}
OPTION = COMMAND | {"COMP_WORDS": "livebode run --o", "COMP_CWORD": "2"}
PROGRAMS: dict[str, tuple[list[str], dict[str, str], int]] = {
    PYTHON: ([sys.executable, "-c", "pass"], {}, 0),
    "livebode --version": ([LIVEBODE, "--version"], {}, 0),
    "livebode --help": ([LIVEBODE, "--help"], {}, 0),
    "completion of a command": ([LIVEBODE], COMMAND, 0),
    "completion of an option of run": ([LIVEBODE], OPTION, 0),
    "livebode rn (a wrong command)": ([LIVEBODE, "rn"], {}, 2),
    "livebode run --no (a wrong option)": ([LIVEBODE, "run", "--no"], {}, 2),
    "livebode run --help": ([LIVEBODE, "run", "--help"], {}, 0),
    "livebode report --help": ([LIVEBODE, "report", "--help"], {}, 0),
    "livebode run log --hop x (a wrong value)": ([LIVEBODE, "run", "log", "--hop", "x"], {}, 2),
    "python -c 'import typer'": ([sys.executable, "-c", "import typer"], {}, 0),
    "python -c 'import rich.console, typer'": ([sys.executable, "-c", "import rich.console, typer"], {}, 0),
}
TARGETS = {
    **dict.fromkeys(("livebode --version", "livebode --help"), 3.0),
    **dict.fromkeys(("completion of a command", "completion of an option of run"), 8.0),
    **dict.fromkeys(("livebode rn (a wrong command)", "livebode run --no (a wrong option)"), 10.0),
    **dict.fromkeys(("livebode run --help", "livebode report --help"), 10.0),
}


def main() -> None:
    times: dict[str, list[float]] = {name: [] for name in PROGRAMS}
    with tempfile.TemporaryDirectory() as folder:
        processes = Processes(Path(folder))
        for _ in range(ROUNDS + 1):  # the first writes the bytecode
            for name, (command, environment, code) in PROGRAMS.items():
                times[name].append(processes.run(*command, environment=environment, codes=[code]).processor_s)
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    for name, median in medians.items():
        ratio = median / medians[PYTHON]
        target = TARGETS.get(name)
        verdict = f"   target ≤ {target:g} ×: {'met' if ratio <= target else 'missed'}" if target else ""
        print(f"{name:40}{1e3 * median:8.1f} ms{ratio:7.1f} ×{verdict}")


if __name__ == "__main__":
    main()
