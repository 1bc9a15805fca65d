"""Designs for several motors, compared with simulations: `python -m studies.mimo_design [recordings]`.

For each machine and kind of experiments: the predicted worst bound in the same time, the error of many simulated
recordings over the predicted sigma, and the largest share of a limit that a signal reaches with noise, from rest.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block
from livebode.simulation import CoreXYLoop, GantryLoop
from livebode_design import MatrixDesign, MatrixLimits, MatrixSpec, MechanismMachine, choose_matrix
from livebode_design.matrix.spec import KINDS
from livebode_matrix import MatrixSettings, MatrixTracker

RECORDINGS, TIME_S = 100, 10.0
MACHINES = {
    "gantry": (
        MechanismMachine(loop=GantryLoop(), noise=(0.05, 0.05, 0.001)),
        MatrixLimits(torque_n_m_max=(3.0, 2.0), speed_max=(20.0, 20.0, 0.3), travel_max=(0.2, 0.2, 0.004)),
        {"lines": "10:60:5", "window": 800},
    ),
    "CoreXY": (
        MechanismMachine(loop=CoreXYLoop(), noise=(0.05, 0.05, 0.0005, 0.0005)),
        MatrixLimits(torque_n_m_max=0.2, travel_max=(2.0, 2.0, 0.001, 0.001)),
        {"lines": "10:80:10", "window": 400},
    ),
}


def recording(design: MatrixDesign, seed: int) -> Block:
    w = np.tile(design.excitation.samples, design.repetitions)
    white = np.random.default_rng(seed).standard_normal((len(design.outputs), w.shape[1]))
    return design.machine.loop.simulate(w, noise=np.reshape(design.machine.noise, (-1, 1)) * white)


def estimate(design: MatrixDesign, block: Block) -> NDArray[np.complex128]:
    """The matrix from all repetitions, shape (lines, outputs, inputs)."""
    used = design.excitation
    settings = MatrixSettings(
        lines=used.lines, output=design.outputs, input=design.inputs, excitation=design.excitations, dwell=used.dwell,
        settle=used.settle, hop=used.lines.window, memory=design.repetitions, average=True,
    )  # fmt: skip
    return MatrixTracker(settings).process(block)[-1:].value[0]


def share_of_limits(design: MatrixDesign, block: Block) -> float:
    """Largest magnitude of a limited signal of a recording over its limit."""
    loop = design.machine.loop
    w = np.tile(design.excitation.samples, design.repetitions)
    travels = dict(zip(design.outputs, np.abs(loop.travels(loop.inputs(w))).max(axis=1)))
    found = []
    for peak in design.peaks:
        kind, _, name = peak.name.partition(" of ")
        channel = f"u{name.removeprefix('motor ')}" if kind == "torque" else name
        size = travels[name] if kind == "travel" else np.abs(block[channel]).max()
        found.append(size / peak.limit)
    return float(max(found))


def row(name: str, kind: str, recordings: int) -> str:
    machine, limits, lines = MACHINES[name]
    design = choose_matrix(MatrixSpec(**lines, kind=kind, time_s=TIME_S), machine, limits)  # type: ignore[arg-type]
    square, shares = np.zeros(design.sigma.shape), []
    for seed in range(recordings):
        block = recording(design, seed)
        square += np.abs(estimate(design, block) - design.response) ** 2 / design.sigma**2 / recordings
        shares.append(share_of_limits(design, block))
    entries, at_lines = np.sqrt(square.mean(axis=0)), np.sqrt(square.mean(axis=(1, 2)))
    worst_hz = design.excitation.lines.frequency_hz[at_lines.argmax()]
    cells = [
        f"{name}, {kind}",
        f"{design.excitation.settle}",
        f"{design.repetitions}",
        f"{design.time_s:.3g} s",
        f"{100 * design.bound.max():.3g} %",
        f"{entries.min():.2f} … {entries.max():.2f}",
        f"{at_lines.max():.2f} at {worst_hz:g} Hz",
        f"{100 * max(shares):.0f} %",
    ]
    return f"| {' | '.join(cells)} |"


def main(words: list[str]) -> int:
    heads = ["machine, experiments", "settle", "repetitions", "time", "worst 95 % bound"]
    heads += ["error over predicted sigma, entries", "worst line", "largest share of a limit"]
    print(f"| {' | '.join(heads)} |")
    print("|---|---|---|---|---|---|---|---|")
    for name in MACHINES:
        for kind in KINDS:
            print(row(name, kind, int(words[0]) if words else RECORDINGS), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
