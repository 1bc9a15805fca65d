"""The kernel on microcontrollers, counted in QEMU: instructions per sample compared with RLS, RAM and flash.

`python -m bench.mcu` prints the tables of docs/how-to/microcontroller.md. Counts are exact and the same
on every machine.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tools.firmware import M4F, M7, ROOT, Core, flash, missing, run

NATIVE = ROOT / "bench" / "mcu_native"
WINDOW, HOP, CHANNELS = 400, 20, 2
TABLES = ("rows", "compact", "hop")
COUNTS = (7, 21)
SAMPLES = 2 * WINDOW
LIMIT, WORST = 600, 750  # 21 lines with a table of rows on the Cortex-M4F: per sample, and of a single push
CLOCK_HZ, RATE_HZ, CYCLES = 168e6, 4000, 2.0


@dataclass(frozen=True)
class Cost:
    """One configuration: instructions per sample, mean and worst; per reading with responses; bytes of RAM."""

    push: float
    worst: int
    hop: float
    ram: int

    @property
    def sample(self) -> float:
        """Instructions per sample with a reading every hop."""
        return self.push + self.hop / HOP


@dataclass(frozen=True)
class Counted:
    """Counts of one core: loops of known length, the kernel by (lines, table), RLS, and flash."""

    loops: dict[int, int]
    kernel: dict[tuple[int, str], Cost]
    rls: float
    flash_step: int
    flash_all: int


def count(core: Core, directory: Path) -> Counted:
    """Builds, runs and reads the counting program."""
    kernel = core.kernel(directory / "kernel")
    own = core.compile([NATIVE / "count.c", NATIVE / "rls.c"], directory)
    program = core.link(directory / "count.elf", kernel + own)
    run(*core.qemu(program, "-icount", "shift=10,sleep=off"), cwd=directory)
    rows = [line.split() for line in (directory / "counted.txt").read_text(encoding="ascii").splitlines()]
    found = {tuple(row[:-2]): (int(row[-2]), int(row[-1])) for row in rows if row[0] != "loop"}
    costs = {}
    for lines in COUNTS:
        for table in TABLES:
            key = (str(lines), table)
            (push, worst), (hop, _), (ram, _) = (found[(*key, what)] for what in ("push", "hop", "bytes"))
            costs[lines, table] = Cost(push / SAMPLES, worst, hop / SAMPLES, ram)
    return Counted(
        {int(row[1]): int(row[2]) for row in rows if row[0] == "loop"},
        costs,
        found["rls",][0] / SAMPLES,
        flash(core, kernel, ("push", "read"), directory / "step.elf"),
        flash(core, kernel, ("size", "init", "push", "read"), directory / "all.elf"),
    )


def table(core: Core, counted: Counted) -> list[str]:
    """The rows of one core's table in Markdown."""
    head = f"{core.name}, float{core.bits}"
    rows = [
        f"| {head}: lines, table | push | worst push | read and FRF | per sample, hop {HOP} | relative to RLS "
        "| RAM, bytes |",
        "|---|---|---|---|---|---|---|",
    ]
    for (lines, name), c in counted.kernel.items():
        share = f"{c.sample / counted.rls:.2f}"
        rows.append(
            f"| {lines}, {name} | {c.push:.0f} | {c.worst} | {c.hop:.0f} | {c.sample:.0f} | {share} | {c.ram} |"
        )
    rows.append(f"| RLS, 6 parameters | {counted.rls:.0f} | | | {counted.rls:.0f} | 1 | {35 * core.bits // 8} |")
    return rows


def main() -> None:
    argparse.ArgumentParser(prog="python -m bench.mcu", description=__doc__).parse_args()
    if absent := missing():
        sys.exit(f"{' and '.join(absent)} not installed: `make system-packages` installs them")
    for core in (M4F, M7):
        with tempfile.TemporaryDirectory() as directory:
            counted = count(core, Path(directory))
        print(*table(core, counted), sep="\n")
        print(f"flash: push and read {counted.flash_step}, with size, init and libgcc {counted.flash_all} bytes")
        print(f"loops of 2n + 1 instructions: {', '.join(f'n = {n}: {found}' for n, found in counted.loops.items())}\n")
        if core is M4F:
            m4f = counted.kernel[21, "rows"]
    cycles = CYCLES * m4f.sample
    share = cycles * RATE_HZ / CLOCK_HZ
    verdict = "met" if m4f.sample <= LIMIT and m4f.worst <= WORST else "missed"
    print(f"{M4F.name}, 21 lines, {CHANNELS} channels: {m4f.sample:.0f} instructions per sample (target {LIMIT}),")
    print(f"at most {m4f.worst} in a push (target {WORST}): {verdict};")
    print(f"about {cycles:.0f} cycles: {100 * share:.1f} % of {CLOCK_HZ / 1e6:.0f} MHz at {RATE_HZ / 1e3:.0f} kHz")


if __name__ == "__main__":
    main()
