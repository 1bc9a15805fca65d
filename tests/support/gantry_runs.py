"""Recordings of the simulated gantry in closed loop, and their configuration as a matrix."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from livebode.configuration import Axis
from livebode.core import Block, Lines
from livebode.excitation import MatrixExcitation
from livebode.runtime import Destination, Outcome, run
from livebode.simulation import Gantry, GantryLoop
from tests.support.command import write_parquet

RATE_HZ, WINDOW, DWELL, SETTLE = 4000, 800, 6, 4
LINES = Lines.parse("10:60:5", rate_hz=RATE_HZ, window=WINDOW)
NAMES = ("w1", "w2", "u1", "u2", "velocity1", "velocity2")
SECTIONS: dict[str, Any] = {
    "signals": {"output": ["velocity1", "velocity2"], "input": ["u1", "u2"], "excitation": ["w1", "w2"]},
    "lines": {"frequencies": "10:60:5", "window": WINDOW},
    "tracking": {"hop": 200},
    "experiments": {"dwell_periods": DWELL, "settle_periods": SETTLE, "memory": 3},
}


def gantry_block(noise: float = 0.02, repetitions: int = 4, seed: int = 0) -> Block:
    """The gantry with orthogonal multisines on both motors; noise on the measured speeds."""
    excitation = MatrixExcitation.orthogonal(LINES, 2, amplitude=0.5, dwell=DWELL, settle=SETTLE)
    block = GantryLoop().simulate(np.tile(excitation.samples, repetitions))
    data = np.array([block[name] for name in NAMES])
    data[4:] += noise * np.random.default_rng(seed).standard_normal((2, data.shape[1]))
    return Block(data, NAMES, rate_hz=RATE_HZ)


SOFTENING = 12
"""Repetitions of `softening_block`."""


def softening_block() -> Block:
    """The gantry, whose belts lose 5 % of their stiffness from one repetition to the next, each in its steady state."""
    excitation = MatrixExcitation.orthogonal(LINES, 2, amplitude=0.5, dwell=DWELL, settle=SETTLE)
    parts = []
    for share in np.linspace(1, 0.95, SOFTENING):
        gantry = Gantry(stiffness_n_per_m=share * Gantry().stiffness_n_per_m)
        block = GantryLoop(gantry=gantry).simulate(np.tile(excitation.samples, 2))
        parts.append(np.array([block[name] for name in NAMES])[:, excitation.samples.shape[1] :])
    data = np.concatenate(parts, axis=1)
    data[4:] += 0.02 * np.random.default_rng(0).standard_normal((2, data.shape[1]))
    return Block(data, NAMES, rate_hz=RATE_HZ)


def gantry_log(path: Path, block: Block) -> Path:
    """The block as a recording."""
    times = {"t [s]": np.arange(len(block)) / block.rate_hz}
    return write_parquet(path, times | {name: block[name] for name in NAMES})


def gantry_axis(log: Path, **sections: Any) -> Axis:
    """The configuration of a recording; `sections` replace those of it."""
    return Axis.of({"source": {"log": log}} | SECTIONS | sections, "test")


def gantry_run(axis: Axis, directory: Path) -> Outcome:
    """The run of a configuration, without pictures."""
    return run(axis, Destination(directory, lambda *_: None))
