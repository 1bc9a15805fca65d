"""`python -m bench.felt [ROW …]`: what a person waits for, with its targets, beside scripts of SciPy.

A row is run, scripts, commands, archive, page, live, hall, axes or hop; without names all are measured, in this order.
Seconds of a program are processor time of all its threads, the least of several rounds; those of the page and the p99
are on the wall.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from bench.processes import Cost, Processes, apart

LIVEBODE = str(Path(sys.executable).with_name("livebode"))
SIGNALS = ("--excitation", "w", "--input", "u", "--output", "y", "--lines", "20:220:10", "--window", "400")
SHORT_ROUNDS, LONG_ROUNDS = 7, 3
SMALL_HOP = "20"
"""Samples between two responses, as of a live machine."""


class Figure(NamedTuple):
    """A value with its unit, and the largest one that it should have; None: for comparison."""

    value: float
    unit: str
    most: float | None = None

    def __str__(self) -> str:
        return f"{self.value:,.0f} {self.unit}" if self.value >= 100 else f"{self.value:.3g} {self.unit}"

    @property
    def verdict(self) -> str:
        """The target, and whether it is met."""
        if self.most is None:
            return ""
        return f"≤ {self.most:g} {self.unit}: {'met' if self.value <= self.most else 'missed'}"


class Row(NamedTuple):
    """A line of the table."""

    what: str
    figures: Sequence[Figure]

    def __str__(self) -> str:
        values = "; ".join(str(one) for one in self.figures)
        verdicts = "; ".join(figure.verdict for figure in self.figures if figure.verdict)
        return f"| {self.what} | {values} | {verdicts} |"


def of_cost(what: str, cost: Cost, s_max: float | None = None, mib_max: float | None = None) -> Row:
    """The row of a program."""
    return Row(what, [Figure(cost.processor_s, "s", s_max), Figure(cost.peak_mib, "MiB", mib_max)])


@dataclass(frozen=True)
class Bench:
    """A directory with short.parquet and long.parquet, and how programs are run there."""

    folder: Path
    processes: Processes

    def least(self, rounds: int, *command: str) -> Cost:
        """The least cost of a command; a fit that is rejected ends with 3."""
        return self.processes.least(rounds, *command, codes=(0, 3))

    def run(self, rounds: int, length: str, *options: str) -> Cost:
        """The least cost of `livebode run` on a recording."""
        log, out = self.folder / f"{length}.parquet", self.folder / length
        return self.least(rounds, LIVEBODE, "run", str(log), "--out", str(out), *SIGNALS, "--force", *options)


def run(bench: Bench) -> Iterator[Row]:
    """The shortest run, and the usual one."""
    yield of_cost("`run`, 2 s", bench.run(SHORT_ROUNDS, "short"), 0.45)
    yield of_cost("`run`, ten minutes at 4 kHz, 21 lines, with pictures", bench.run(LONG_ROUNDS, "long"), 1.0, 220)
    size = sum(path.stat().st_size for path in (bench.folder / "long").rglob("*"))
    yield Row("`run`, ten minutes: its directory", [Figure(size / 1e6, "MB", 20)])
    yield of_cost(f"`run --hop {SMALL_HOP}`, the same ten minutes", bench.run(LONG_ROUNDS, "long", "--hop", SMALL_HOP))


def scripts(bench: Bench) -> Iterator[Row]:
    """The same ten minutes with SciPy, at the hops of both runs."""
    log, out = str(bench.folder / "long.parquet"), bench.folder / "script"
    bench.run(1, "long")
    hop = json.loads((bench.folder / "long" / "run.json").read_text(encoding="utf-8"))["found"]["hop"]
    out.mkdir()
    script = (sys.executable, "-m", "bench.scipy_scripts")
    for every in dict.fromkeys((str(hop), SMALL_HOP)):
        cost = bench.least(LONG_ROUNDS, *script, "responses", log, str(out), every)
        yield of_cost(f"SciPy on them: read, G and coherence every {every} samples, write, two plots", cost)
    cost = bench.least(LONG_ROUNDS, *script, "average", log, str(out))
    yield of_cost("SciPy on them: read, one averaged `csd` and coherence, write, two plots", cost)


def commands(bench: Bench) -> Iterator[Row]:
    """The commonest commands after a run of 2 s."""
    bench.run(1, "short")
    directory, log = str(bench.folder / "short"), str(bench.folder / "short.parquet")
    sql = "SELECT frequency_hz, avg(coherence) FROM responses GROUP BY 1"
    for what, words in {
        "`fit`": ("fit", directory),
        "`report`": ("report", directory, "--force"),
        "`export --sql`": ("export", directory, "--sql", sql),
        "`inspect`": ("inspect", log),
        "`doctor`": ("doctor",),
    }.items():
        yield of_cost(f"{what}, 2 s", bench.least(SHORT_ROUNDS, LIVEBODE, *words), 0.5)


def archive(bench: Bench) -> Iterator[Row]:
    """A worker of an archive."""
    from bench.archive import WORKER_MS_MAX, worker_ms

    yield Row(
        "a recording of 10 s in an archive's worker", [Figure(apart(worker_ms, bench.folder), "ms", WORKER_MS_MAX)]
    )


def page(_: Bench) -> Iterator[Row]:
    """The page of a live run over a slow link."""
    from bench.browser import chromium
    from bench.page import REQUESTS_MAX, SECONDS_MAX, measured

    with chromium() as browser:
        visits = measured(browser, 150.0, SHORT_ROUNDS)
    for what, (requests, kilobytes, seconds) in zip(("first", "second"), visits):
        figures = Figure(requests, "requests", REQUESTS_MAX), Figure(kilobytes, "kB"), Figure(seconds, "s", SECONDS_MAX)
        yield Row(f"the page until its first curve, latency 150 ms, {what} visit", figures)


def block_ms(spectra: bool, together: int) -> float:
    """Milliseconds of a Block, in a process that collects garbage as a command does."""
    from bench.live_blocks import Load, measure
    from livebode.cli.start import OBJECTS_NEW

    gc.set_threshold(OBJECTS_NEW)
    gc.freeze()
    return measure(Load(spectra, together), 20.0)


def live(_: Bench) -> Iterator[Row]:
    """One live axis."""
    for what, load, most in (("a live spectrum", (True, 1), 0.12), ("a live Block of 50 ms", (False, 2), 0.3)):
        yield Row(what, [Figure(min(apart(block_ms, *load) for _ in range(LONG_ROUNDS)), "ms", most)])


def hall(_: Bench) -> Iterator[Row]:
    """Many axes of spectra in one process."""
    from bench.hall import Hall, measure

    found = measure(Hall(256, spectra=True), 20.0)
    figures = [Figure(found["p99, ms"], "ms", 50), Figure(found["cores used"], "cores")]
    yield Row("256 axes of spectra, 20/s, one process: p99", figures)


def axes(bench: Bench) -> Iterator[Row]:
    """Many axes of samples, with everything."""
    from bench import growth_axes, growth_live

    apart(growth_live.prepare, bench.folder)
    cores = apart(growth_axes.measure, bench.folder, 64).ms_per_s / 1e3
    yield Row("64 axes, each with fit, monitor, record and page", [Figure(cores, "cores", 1.5)])


def hop(_: Bench) -> Iterator[Row]:
    """Rows of the kernel."""
    from bench.blocks import Ours
    from bench.work import ROWS, side_by_side

    bins = list(range(1, 22))
    best = side_by_side({f"{every}": Ours(400, bins, every, "window") for every in (20, 100)}, 2.0)
    for (every, seconds), most in zip(best.items(), (40, 120)):
        yield Row(f"a row of 21 lines every {every} samples, window 400", [Figure(1e9 * seconds / ROWS, "ns", most)])


ROWS_OF: dict[str, Callable[[Bench], Iterator[Row]]] = {
    one.__name__: one for one in (run, scripts, commands, archive, page, live, hall, axes, hop)
}


def measured(names: Collection[str]) -> Iterator[Row]:
    """These rows, as they come."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as in a command and in a worker
    with tempfile.TemporaryDirectory() as name:
        bench = Bench(Path(name), Processes(Path(name) / "bytecode"))
        bench.processes.run(sys.executable, "-m", "bench.job", name)
        bench.run(1, "short")  # writes the bytecode
        for row in names:
            yield from ROWS_OF[row](bench)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.felt", description=__doc__)
    parser.add_argument("rows", nargs="*", metavar="ROW", choices=[*ROWS_OF, []])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows there, too")
    options = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors\n")
    print("| what | measured | target |\n|---|---|---|")
    rows = []
    for row in measured(options.rows or ROWS_OF):
        print(row, flush=True)
        rows.append(row)
    if options.json:
        options.json.write_text(json.dumps(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
