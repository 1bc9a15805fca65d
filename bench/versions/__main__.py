"""`python -m bench.versions [--base REV]`: the speed of the working tree and of another commit, measured alternately.

Each round starts both versions again and lets them take turns; its ratio is that of the cheapest turns. The result is
the median of the ratios with its quartiles. Rounds are added until the median is certain within its 95 % interval to be
on one side of the limit, at most three times as many. Times are processor times of all threads, which a busy neighbour
changes less than wall times.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench import history
from bench.versions import scenarios
from bench.versions.installed import archived, commit_of, git, installed, working_tree

LIMIT, TURNS = 1.03, 4
SCRIPT = Path(scenarios.__file__).name


@dataclass(frozen=True)
class Comparison:
    """Processor seconds of one scenario by round, of the base and of the working tree."""

    name: str
    base_s: list[float]
    now_s: list[float]

    @property
    def quartiles(self) -> tuple[float, float, float]:
        ratios = np.array(self.now_s) / np.array(self.base_s)
        lower, middle, upper = np.quantile(ratios, [0.25, 0.5, 0.75])
        return float(lower), float(middle), float(upper)

    @property
    def verdict(self) -> str:
        """By the 95 % interval of the median; 1.35 and 1.25: quartiles and median of a normal distribution."""
        lower, middle, upper = self.quartiles
        margin = 1.96 * 1.25 * (upper - lower) / 1.35 / np.sqrt(len(self.base_s))
        if middle - margin > LIMIT:
            return "slower"
        if middle + margin <= LIMIT:
            return "faster" if middle + margin < 2 - LIMIT else "within 3 %"
        return "undecided"

    def __str__(self) -> str:
        lower, middle, upper = self.quartiles
        base_ms, now_ms = 1e3 * np.median(self.base_s), 1e3 * np.median(self.now_s)
        return f"{self.name:32}{base_ms:10.2f}{now_ms:10.2f}{middle:8.3f}{lower:9.3f} … {upper:.3f}   {self.verdict}"


def environment() -> dict[str, str]:
    """One thread for BLAS, and no path to the livebode of this checkout."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    return kept | {"OPENBLAS_NUM_THREADS": "1"}


def opened(python: Path, folder: Path, name: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [python, folder / SCRIPT, folder, name],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
    )


def answer(worker: subprocess.Popen[str], name: str) -> str:
    assert worker.stdout is not None
    line = worker.stdout.readline()
    if not line:
        raise SystemExit(f"{name!r} failed in {worker.args[0]}")  # type: ignore[index]
    return line


def measured_round(pythons: tuple[Path, Path], folder: Path, name: str, turns: int) -> tuple[float, float]:
    """Cheapest turn of base and of now; who is first alternates."""
    with opened(pythons[0], folder, name) as base, opened(pythons[1], folder, name) as now:
        workers = (base, now)
        for worker in workers:
            answer(worker, name)
        best = [np.inf, np.inf]
        for turn in range(turns):
            for i in (0, 1) if turn % 2 == 0 else (1, 0):
                print("", file=workers[i].stdin, flush=True)
                best[i] = min(best[i], float(answer(workers[i], name)))
        for worker in workers:
            assert worker.stdin is not None
            worker.stdin.close()
    return best[0], best[1]


def compared(pythons: tuple[Path, Path], folder: Path, name: str, rounds: int) -> Comparison:
    result = Comparison(name, [], [])
    while len(result.base_s) < rounds or (result.verdict == "undecided" and len(result.base_s) < 3 * rounds):
        base_s, now_s = measured_round(pythons, folder, name, 2 if name in scenarios.COMMANDS else TURNS)
        result.base_s.append(base_s)
        result.now_s.append(now_s)
    return result


def default_base() -> str:
    """The newest tag, or the commit of the newest stored result."""
    tags = git("tag", "--list", "v*", "--sort=-creatordate", "--merged").split()
    return tags[0] if tags else history.newest()["commit"]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.versions", description=__doc__)
    parser.add_argument("--base", default="", help="commit to compare with [default: the newest tag or stored result]")
    parser.add_argument("--rounds", type=int, default=9, help="rounds of each scenario, at least")
    parser.add_argument("--only", default="", help="only scenarios whose name contains this text")
    options = parser.parse_args()
    base = commit_of(options.base or default_base())
    names = [name for name in (*scenarios.IN_PROCESS, *scenarios.COMMANDS) if options.only in name]
    with tempfile.TemporaryDirectory(prefix="livebode-versions-") as scratch:
        folder = Path(scratch)
        print(f"installing {base} and the working tree …", flush=True)
        sources = {"base": archived(base, folder / "base"), "now": working_tree(folder / "now")}
        pythons = tuple(installed(source, folder / f"{name}-venv") for name, source in sources.items())
        shutil.copy2(scenarios.__file__, folder / SCRIPT)
        scenarios.write_recordings(folder)
        print(f"processor time; base {base}, now: the working tree at {commit_of('HEAD')}")
        print(f"{'':32}{'base, ms':>10}{'now, ms':>10}{'ratio':>8}{'quartiles':>18}", flush=True)
        found = []
        for name in names:
            found.append(compared((pythons[0], pythons[1]), folder, name, options.rounds))
            print(found[-1], flush=True)
    slower = [comparison.name for comparison in found if comparison.verdict == "slower"]
    print(f"slower by more than 3 %: {', '.join(slower) or 'none'}")
    raise SystemExit(1 if slower else 0)


if __name__ == "__main__":
    main()
