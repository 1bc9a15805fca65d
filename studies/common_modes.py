"""Modes common to two outputs: order found and coverage of the bounds: `python -m studies.common_modes [runs]`.

The truth is a machine in state space, sampled behind its zero-order hold by SciPy, with independent noise at each line.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import NDArray
from scipy import linalg, signal

from livebode.core import Lines, Response
from livebode.fitting import CommonPoles, fit_common_poles
from studies.result import Verdict

RUNS = 200
RATE_HZ = 1000.0
PROBABILITIES = (0.63, 0.98)

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Modes = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Case:
    """Frequencies and damping ratios, displacements at each output (outputs, modes), lines, and noise over |G|."""

    name: str
    modes: Modes
    outputs: tuple[tuple[float, ...], ...]
    lines: str
    noise: float


CASES = (
    Case("two modes, 30 lines", ((12.0, 0.02), (60.0, 0.05)), ((1.0, 0.5), (0.3, -1.0)), "2:120:4", 0.02),
    Case("ζ 0.2 %, 1 Hz apart, 100 lines", ((25.4, 0.002), (26.4, 0.002)), ((1, 0.8), (-0.4, 1)), "1:100:1", 0.01),
    Case("one output, 12 lines", ((12.0, 0.05),), ((1.0,),), "5:27:2", 0.01),
)


def machine(modes: Modes, outputs: Floats) -> control.StateSpace:
    """Modes in block-diagonal form, each driven with its square frequency; rows of `outputs` are displacements."""
    blocks = [np.array([[0, 1], [-((2 * np.pi * f) ** 2), -2 * z * 2 * np.pi * f]]) for f, z in modes]
    drive = np.concatenate([[0.0, (2 * np.pi * f) ** 2] for f, _ in modes])[:, np.newaxis]
    shown = np.zeros((len(outputs), 2 * len(modes)))
    shown[:, ::2] = outputs
    return control.ss(linalg.block_diag(*blocks), drive, shown, np.zeros((len(outputs), 1)))


def sampled(system: control.StateSpace, lines: Lines) -> Complex:
    """Shape (outputs, lines)."""
    a, b, c, d, _ = signal.cont2discrete((system.A, system.B, system.C, system.D), 1 / lines.rate_hz)
    return np.array([(c @ np.linalg.solve(z * np.eye(len(a)) - a, b) + d)[:, 0] for z in lines.z]).T


def measured(lines: Lines, truth: Complex, share: float, seed: int) -> list[Response]:
    """Each output with noise of a share of its size and a floor."""
    rng, ones = np.random.default_rng(seed), np.ones(len(lines))
    found = []
    for one in truth:
        sigma = share * (np.abs(one) + 0.1 * np.median(np.abs(one)))
        noise = rng.standard_normal((2, len(lines))) * sigma / np.sqrt(2)
        found.append(Response(lines, one + noise[0] + 1j * noise[1], sigma, np.inf, ones, ones > 0, 0, 999, 0.5))
    return found


def fitted(case: Case, seed: int, order: int | None = None) -> CommonPoles:
    """One run of a case."""
    lines = Lines.parse(case.lines, rate_hz=RATE_HZ, window=1000)
    truth = sampled(machine(case.modes, np.array(case.outputs)), lines)
    return fit_common_poles(measured(lines, truth, case.noise, seed), order=order)


def covered(case: Case, runs: int, order: int | None = None) -> tuple[float, Floats]:
    """Share of the runs with the right order; of those, shares of frequencies and dampings inside the bounds."""
    inside, right = [], 0
    for seed in range(runs):
        found = fitted(case, seed, order)
        if found.status != "ok" or found.order != len(case.modes):
            continue
        right += 1
        for i, truth in enumerate(case.modes):
            for what, value in zip(("frequency", "damping"), truth):
                error = abs(found[f"{what}_{i + 1}"] - value)
                inside.append([error < found.bound(f"{what}_{i + 1}", p) for p in PROBABILITIES])
    return right / runs, np.mean(inside, axis=0)


def main(runs: int) -> None:
    for case in CASES:
        right, shares = covered(case, runs)
        print(Verdict(f"{case.name}: right number of modes", right, 0.95, at_least=True))
        for probability, share in zip(PROBABILITIES, shares):
            scatter = 4 * (probability * (1 - probability) / (2 * len(case.modes) * runs)) ** 0.5
            claim = f"{case.name}: covered by the {100 * probability:.0f} % bound ({100 * share:.1f} %), off by"
            print(Verdict(claim, abs(share - probability), scatter), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
