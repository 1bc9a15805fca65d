"""`python -m bench.start`: what the command line costs before it does anything, in the cost of Python's own start; and
the commands on a recording of two seconds.

Processor time, user and system, of a child process with bytecode, as installed; the median of 20, the programs in
turn. What prints help or an error, or completes, loads Typer and nothing else that is large; Typer alone is the bound
of these rows. A wrong value costs more: Typer converts it by pydantic.

    python -m bench.start --commands    # run, fit, report, export, inspect and doctor alone; the least of each
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
WORK_S = {"run": 0.45, **dict.fromkeys(("fit", "report", "export", "inspect", "doctor"), 0.5)}


def commands(processes: Processes, folder: Path) -> None:
    """Print the least processor time of the commands on a recording of two seconds."""
    processes.run(LIVEBODE, "example", "standstill", "--out", str(folder))
    log, run = str(folder / "standstill.csv"), str(folder / "run")
    signals = ("--excitation", "w", "--input", "u", "--output", "velocity")
    work = {
        "run": ("run", log, *signals, "--out", run, "--force"),
        "fit": ("fit", run),
        "report": ("report", run),
        "export": ("export", run, "--sql", "SELECT count(*) FROM responses"),
        "inspect": ("inspect", log),
        "doctor": ("doctor",),
    }
    least = dict.fromkeys(work, float("inf"))
    for _ in range(ROUNDS // 2):
        for name, words in work.items():
            least[name] = min(least[name], processes.run(LIVEBODE, *words)[0])
    for name, seconds in least.items():
        verdict = "met" if seconds <= WORK_S[name] else "missed"
        print(f"livebode {name:31}{1e3 * seconds:8.0f} ms   target ≤ {1e3 * WORK_S[name]:.0f} ms: {verdict}")


def main() -> None:
    if "--commands" in sys.argv:
        with tempfile.TemporaryDirectory() as name:
            commands(Processes(Path(name) / "bytecode"), Path(name))
        return
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
