"""The recordings that every peer gets: full strokes of the two-mass axis under the multisine, with noise."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from livebode import Block, multisine
from livebode.simulation import BeltAxis, Friction, Mechanics, Sensor, SimulatedAxis, Strokes, Truth
from studies.common import RATE_HZ, lines
from studies.common import SIGMA as NOISE_RAD_PER_S
from studies.peers import two_mass

LINES = lines()
HOP = 20
STROKES = Strokes()  # 0.25 … 1.6 m and back at 0.38 m/s


@dataclass(frozen=True, eq=False)
class Case:
    """What the machine is like in a set of recordings, and when the peers are asked.

    They are asked at every HOP of the second cycle at full speed, from `settled_s` after the acceleration on; that is
    at least LINES.window, so that the last window of everybody was run through at full speed.
    """

    name: str
    settled_s: float = 0.5
    backward: bool = False
    strokes: Strokes = STROKES
    encoder_counts_per_turn: int = 0
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def two_masses(self) -> bool:
        return "mechanics" not in self.options


MAIN = Case("The paper's stroke")
CASES = (
    MAIN,
    Case("Forward and return, from the acceleration on", settled_s=0.1, backward=True),
    Case("15 N of friction at the cart", options={"friction": Friction(load_coulomb_n=15.0)}),
    Case("A 20-bit encoder", encoder_counts_per_turn=1 << 20),
    Case("0.2 m/s", strokes=Strokes(speed_m_per_s=0.2)),
    Case("0.8 m/s", strokes=Strokes(speed_m_per_s=0.8)),
    Case("Three masses", options={"mechanics": Mechanics(masses=3)}),
)


@dataclass(frozen=True, eq=False)
class Recording:
    """What was logged, and the truth for the judge alone."""

    case: Case
    block: Block
    truth: Truth
    judged: np.ndarray  # numbers of the newest samples at which everybody is asked

    @property
    def stroke_samples(self) -> int:
        """One way, with the rest before it."""
        return len(self.case.strokes.cycle(RATE_HZ)[0]) // 2

    @cached_property
    def true_stiffness(self) -> np.ndarray:
        return self.truth.stiffness_n_per_m

    def true_parameters(self, sample: np.ndarray) -> np.ndarray:
        """Js, mL, Keff, bs at moments that may lie between samples, shape (moments, 4)."""
        truth, number = self.truth, np.arange(len(self.truth))
        rows = truth.inertia_kg_m2, truth.load_kg, self.true_stiffness, truth.damping_n_s_per_m
        return np.stack([np.interp(sample, number, row) for row in rows], axis=-1)

    def true_response(self, sample: np.ndarray) -> np.ndarray:
        """The local sampled linearisation at LINES, shape (moments, lines)."""
        if self.case.two_masses:
            return two_mass.response(self.true_parameters(sample), LINES.frequency_hz, RATE_HZ)
        return np.array(
            [self.truth.sampled(n).response(LINES.frequency_hz) for n in np.rint(sample).astype(int).tolist()]
        )


def record(seed: int, case: Case = MAIN, noise_rad_per_s: float = NOISE_RAD_PER_S) -> Recording:
    """A cycle for the loop and everybody's memory to settle, then the cycle in which all are judged."""
    cycle = len(case.strokes.cycle(RATE_HZ)[0])
    axis = BeltAxis(
        motion=case.strokes,
        excitation_n_m=multisine(LINES),
        seconds=2 * cycle / RATE_HZ,
        sensor=Sensor(noise_rad_per_s=noise_rad_per_s, encoder_counts_per_turn=case.encoder_counts_per_turn),
        seed=seed,
        **case.options,
    )
    block, truth = SimulatedAxis(axis).run()
    return Recording(case, block, truth, judged(case, cycle))


def judged(case: Case, cycle: int) -> np.ndarray:
    """Rows of the second cycle before which the reference ran at full speed for `settled_s`."""
    _, speed = case.strokes.cycle(RATE_HZ)
    full = np.abs(speed) > case.strokes.speed_m_per_s * (1 - 1e-9)
    if not case.backward:
        full &= speed > 0
    busy = np.concatenate([[0], np.cumsum(np.tile(full, 2))])
    settled = round(case.settled_s * RATE_HZ)
    row = np.arange(HOP - 1, 2 * cycle, HOP)
    row = row[row >= cycle]
    return row[busy[row + 1] - busy[row + 1 - settled] == settled]
