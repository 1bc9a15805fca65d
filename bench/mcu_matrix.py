"""Matrices of 2 × 2 responses on microcontrollers, counted in QEMU: `python -m bench.mcu_matrix`.

examples/gantry replays a simulated gantry in closed loop: four signals in one sliding DFT, and a matrix at every hop.
Beside it are the six channels of two runs that excite one motor each, in pairs and without responses, as `bench.mcu`
counts them. Counts are exact and the same on every machine.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.mcu import count
from livebode.core import Block, Lines
from livebode.excitation import MatrixExcitation
from livebode.simulation import GantryLoop
from tools.firmware import M4F, M7, ROOT, Core, missing, run

EXAMPLE = ROOT / "examples" / "gantry"
LINES = Lines.parse("20:220:10", rate_hz=4000, window=400)
TARGET = 1.2
AMPLITUDE_N_M, DWELL, SETTLE, HOP = 0.05, 3, 1, 100
REPETITIONS = 3
EXCITATION = MatrixExcitation.orthogonal(LINES, 2, AMPLITUDE_N_M, dwell=DWELL, settle=SETTLE)
SIGNALS = "u1", "u2", "velocity1", "velocity2"


@dataclass(frozen=True)
class Count:
    """Instructions: the total, the worst, and of how many calls."""

    total: int
    worst: int
    number: int

    @property
    def mean(self) -> float:
        return self.total / self.number


@dataclass(frozen=True)
class Played:
    """What the target made of the samples.

    Attributes
    ----------
    excitation
        Torques that it would add, (2, samples).
    newest, matrices, valid
        Numbers of the last samples, (rows,); matrices (rows, lines, 2, 2); valid lines (rows, lines).
    cycle, matrix
        Instructions of a control cycle and of a matrix of all lines.
    """

    excitation: NDArray[np.floating]
    newest: NDArray[np.uint64]
    matrices: NDArray[np.complexfloating]
    valid: NDArray[np.bool_]
    cycle: Count
    matrix: Count


def recording(noise_rad_per_s: float = 0.01) -> Block:
    """A gantry in closed loop with these excitations, in float32."""
    w = np.tile(EXCITATION.samples, REPETITIONS)
    noise = noise_rad_per_s * np.random.default_rng(0).standard_normal((3, w.shape[1]))
    block = GantryLoop().simulate(w, noise=noise)
    data = block.data.astype(np.float32).astype(np.float64)
    return Block(data, [channel.name for channel in block.channels], rate_hz=block.rate_hz)


def program(core: Core, directory: Path) -> Path:
    """The example for a core, with the excitation that the drive's example writes."""
    run(sys.executable, ROOT / "examples" / "drive" / "excitation.py", "20:220:10", directory / "excitation.h")
    include = f"-I{directory}", f"-I{EXAMPLE}", f"-I{ROOT / 'bench' / 'mcu_native'}", f"-DGANTRY_HOP={HOP}"
    # The header has doubles, and its examples are C11: _Static_assert.
    quiet = "-Wno-float-conversion", "-Wno-pedantic"
    own = core.compile([EXAMPLE / "gantry.c", EXAMPLE / "replay.c"], directory, *include, *quiet)
    return core.link(directory / "gantry.elf", core.kernel(directory / "kernel") + own)


def play(core: Core, directory: Path, block: Block) -> Played:
    """Builds the example, and plays the samples in QEMU."""
    kind = np.dtype(f"<f{core.bits // 8}")
    samples = np.array([block.data[block.index(name)] for name in SIGNALS], kind)
    (directory / "samples.bin").write_bytes(np.ascontiguousarray(samples.T).tobytes())
    run(*core.qemu(program(core, directory), "-icount", "shift=10,sleep=off"), cwd=directory)
    record = np.dtype(
        [("newest", "<u8"), ("response", kind, (len(LINES), 2, 2, 2)), ("valid", np.bool_, (len(LINES),))]
    )
    rows = np.frombuffer((directory / "matrices.bin").read_bytes(), record)
    response = rows["response"]
    counted = [int(word) for word in (directory / "counted.txt").read_text(encoding="ascii").split()]
    return Played(
        np.frombuffer((directory / "excitation.bin").read_bytes(), kind).reshape(-1, 2).T,
        rows["newest"],
        response[..., 0] + 1j * response[..., 1],
        rows["valid"],
        Count(*counted[:3]),
        Count(*counted[3:]),
    )


def main() -> None:
    argparse.ArgumentParser(prog="python -m bench.mcu_matrix", description=__doc__).parse_args()
    if absent := missing():
        sys.exit(f"{' and '.join(absent)} not installed: `make system-packages` installs them")
    print(f"2 × 2, {len(LINES)} lines, window {LINES.window}, hop {HOP}, compact table; instructions")
    print("| core | cycle | worst cycle | matrix | per sample | six channels | ratio |")
    print("|---|---|---|---|---|---|---|")
    for core in (M4F, M7):
        with tempfile.TemporaryDirectory() as directory:
            found = play(core, Path(directory), recording())
        with tempfile.TemporaryDirectory() as directory:
            channels = 3 * count(core, Path(directory)).kernel[len(LINES), "compact"].push
        sample = (found.cycle.total + found.matrix.total) / found.cycle.number
        ratio = sample / channels
        print(
            f"| {core.name}, float{core.bits} | {found.cycle.mean:.0f} | {found.cycle.worst} "
            f"| {found.matrix.mean:.0f} | {sample:.0f} | {channels:.0f} | {ratio:.2f} |"
            f" {'met' if ratio <= TARGET else 'missed'}"
        )


if __name__ == "__main__":
    main()
