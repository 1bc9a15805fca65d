"""Modes of matrices and changes of a gantry, compared with the truth: `python -m studies.matrix_change [runs]`.

Each run is a recording of the simulated gantry in closed loop with noise on the speeds, alike in part on both motors,
which the loop feeds back into the torques. What counts: how often the 95 % bounds of frequencies, dampings and physical
parameters cover the truth, also of a fit that lacks a mode; how often a healthy machine raises an alarm; and how often
the part that changed is named, as the only one or first of several. A CoreXY machine with other lines, excitation and
noise shows that the structure and the bounds do not depend on the gantry.

The share of the stated sigma that independent lines would give is printed too: leakage makes the errors of lines
beside a slow mode alike, and where in its period the excitation begins decides whether they add up or cancel.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Lines, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.simulation import CoreXY, CoreXYLoop, Gantry, GantryLoop, MotorLoop
from livebode_matrix import (
    MatrixModes,
    MatrixSettings,
    MatrixTracker,
    compare_gantries,
    compare_matrices,
    fit_gantry,
    fit_matrix,
)
from livebode_matrix.gantry_change import CART_PLACE
from livebode_matrix.gantry_fit import PARAMETERS, parameters_of
from studies.result import Verdict

RUNS, AT_ONCE, SEARCHED = 200, 25, 20
RATE_HZ, NOISE_RAD_PER_S, AMPLITUDE_N_M = 1000.0, 0.05, 0.2
LINES = Lines.parse("5:100:2.5", rate_hz=RATE_HZ, window=400)
PERIODS = {"dwell": 3, "settle": 2}
MEMORY = 6
EXCITATION = MatrixExcitation.orthogonal(LINES, 2, AMPLITUDE_N_M, **PERIODS)
GANTRY = Gantry(motor_viscous_n_m_s=0.05, right_stiffness_n_per_m=4e5, right_damping_n_s_per_m=150.0)
COREXY = CoreXY(motor_viscous_n_m_s=2e-3, stiffness_b_n_per_m=1.8e4, damping_n_s_per_m=8.0)
SETTINGS = MatrixSettings(
    lines=LINES,
    output=["velocity1", "velocity2"],
    input=["u1", "u2"],
    excitation=["w1", "w2"],
    memory=MEMORY,
    average=True,
    hop=LINES.window,
    **PERIODS,
)
WIDE = "a bound that is too wide; see its scatter over the stated sigma, and docs/explanation/mimo.md"
BEGINS = (0.0, 0.25, 0.5, 0.75)  # of the period
ALPHAS = (0.1, 0.05, 0.01)
CHANGES = {
    "left belt's stiffness": {"stiffness_n_per_m": 0.98 * 4e5},
    "right belt's stiffness": {"right_stiffness_n_per_m": 0.98 * 4e5},
    "left belt's damping": {"damping_n_s_per_m": 1.1 * 150},
    "right belt's damping": {"right_damping_n_s_per_m": 1.1 * 150},
    "beam's mass": {"beam_kg": 1.03 * 12},
    "beam's inertia": {"beam_inertia_kg_m2": 1.02 * 1.6},
    "cart's mass": {"cart_kg": 1.05 * 6},
    "yaw stiffness": {"yaw_stiffness_n_m": 0.97e4},
}

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


def matrices(
    gantry: Gantry, runs: int, rng: np.random.Generator, excitation: MatrixExcitation = EXCITATION
) -> list[MatrixResponses]:
    """The matrices of each recording; the last one is from all its repetitions."""
    loop = GantryLoop(gantry=gantry, rate_hz=RATE_HZ)

    def noise(*shape: int) -> Floats:
        found = NOISE_RAD_PER_S * rng.standard_normal(shape)
        found[1] = 0.6 * found[0] + 0.8 * found[1]
        return found

    return _tracked(loop, SETTINGS, np.tile(excitation.samples, MEMORY), runs, noise)


def corexy_matrices(runs: int, seed: int) -> list[MatrixResponses]:
    """Of a CoreXY machine: interleaved lines of random phases, noise of a pole and independent on all outputs."""
    rng, loop = np.random.default_rng(seed), CoreXYLoop(corexy=COREXY, rate_hz=2000.0)
    lines = Lines.parse("4:120:4", rate_hz=2000, window=1000)
    excitation = MatrixExcitation.interleaved(lines, 2, 0.02, "random", **PERIODS)
    settings = replace(SETTINGS, lines=lines, hop=lines.window)

    def noise(*shape: int) -> Floats:
        white = 0.5 * rng.standard_normal((shape[0], shape[1] + 1, shape[2]))
        found = white[:, 1:] + 0.8 * white[:, :-1]
        found[2:] *= 1e-2  # m/s
        return np.asarray(found)

    return _tracked(loop, settings, np.tile(excitation.samples, MEMORY), runs, noise)


def _tracked(
    loop: MotorLoop, settings: MatrixSettings, w: Floats, runs: int, noise: Callable[..., Floats]
) -> list[MatrixResponses]:
    found, outputs = [], len(loop.mechanism.outputs)
    for begin in range(0, runs, AT_ONCE):
        inputs = np.zeros((4 + outputs, w.shape[1], min(AT_ONCE, runs - begin)))
        inputs[:2], inputs[4:] = w[:, :, np.newaxis], noise(outputs, *inputs.shape[1:])
        blocks = (
            Block(np.ascontiguousarray(one), loop.channels, loop.rate_hz)
            for one in np.moveaxis(loop.signals(inputs), 2, 0)
        )
        found += [MatrixTracker(settings).process(block) for block in blocks]
    return found


def true_poles(machine: Gantry | CoreXY) -> Complex:
    """Without those of the positions, which speeds do not show."""
    poles = np.linalg.eigvals(machine.state_space[0])
    return np.asarray(poles[np.abs(poles) > 1e-3], dtype=np.complex128)


def true_modes(machine: Gantry | CoreXY) -> Floats:
    """Frequency and damping ratio of each mode, shape (modes, 2)."""
    poles = true_poles(machine)
    poles = poles[poles.imag > 0]
    return np.array([[abs(p) / (2 * np.pi), -p.real / abs(p)] for p in sorted(poles, key=abs)])


def modes(measured: list[MatrixResponses], machine: Gantry | CoreXY) -> tuple[float, Floats, Floats]:
    """Share of right structures; of frequencies and dampings 95 % coverage, and scatter over sigma, (modes, 2)."""
    truth = true_modes(machine)
    searched = [fit_matrix(one) for one in measured[: min(SEARCHED, len(measured))]]
    right = [one for one in searched if _is_right(one, machine)]
    fits = [fit_matrix(one, like=right[0]) for one in measured]
    inside = np.mean([_inside(one, truth) for one in fits], axis=0)
    parts = [[one.parameters.value[0, : truth.size], one.parameters.sigma[0, : truth.size]] for one in fits]
    value, sigma = np.moveaxis(parts, 1, 0)
    scatter = np.std(value, axis=0) / np.sqrt(np.mean(sigma**2, axis=0))
    return len(right) / len(searched), inside, scatter.reshape(truth.shape)


def _is_right(found: MatrixModes, machine: Gantry | CoreXY) -> bool:
    """Whether number and kind of its poles are those of the machine, without further terms."""
    poles = true_poles(machine)
    of, names = found.best, found.parameters.names
    plain = of is not None and not (of.structure.integrators or of.structure.direct or of.structure.delays)
    complex_ones = sum(name.startswith("frequency_") for name in names)
    return plain and found.order == len(poles) and complex_ones == np.count_nonzero(poles.imag > 0)


def lacking(measured: list[MatrixResponses]) -> tuple[float, float, Floats]:
    """Of a fit without the mode at 71 Hz, to 62.5 Hz: share that says so, mean ε, and 95 % coverage (modes, 2)."""
    band, truth = (5.0, 62.5), true_modes(GANTRY)[:2]
    first = fit_matrix(measured[0], "modal", order=2, band_hz=band)
    found = [fit_matrix(one, like=first, band_hz=band) for one in measured]
    said, epsilon = np.mean([not one.complete for one in found]), np.mean([one.epsilon[0] for one in found])
    return float(said), float(epsilon), np.mean([_inside(one, truth) for one in found], axis=0)


def _inside(found: MatrixModes, truth: Floats) -> NDArray[np.bool_]:
    names = [[f"{what}_{r + 1}" for what in ("frequency", "damping")] for r in range(len(truth))]
    if found.status != "ok":
        return np.zeros(truth.shape, dtype=np.bool_)
    return np.array([[abs(found[n] - t) < found.bound(n) for n, t in zip(*pair)] for pair in zip(names, truth)])


def parameters(measured: list[MatrixResponses]) -> Floats:
    """95 % coverage of each physical parameter."""
    truth, described = parameters_of(GANTRY), replace(GANTRY, stiffness_n_per_m=3.6e5, beam_kg=13.0)
    fits = [fit_gantry(one, described) for one in measured]
    return np.mean([np.abs(one.value - truth) < one.bounds() for one in fits], axis=0)


def begun(runs: int, share: float) -> tuple[float, float]:
    """Scatter of the yaw stiffness over its stated sigma, with independent lines and with those that are alike.

    The excitation begins at this share of its period: Schroeder's phases are a sweep, and this is where it begins.
    """
    turned = np.angle(EXCITATION.spectra[0, 0] * 1j) + 2 * np.pi * share * np.array(LINES.bins)
    excitation = MatrixExcitation.orthogonal(LINES, 2, AMPLITUDE_N_M, turned - np.pi / 2, **PERIODS)
    fits = [fit_gantry(one, GANTRY) for one in matrices(GANTRY, runs, np.random.default_rng(3), excitation)]
    at = [name for name, _ in PARAMETERS].index("yaw stiffness")
    scatter = np.std([one.value[at] for one in fits])
    alone, alike = ([one[at, at] for one in part] for part in zip(*((f.independent, f.covariance) for f in fits)))
    return float(scatter / np.sqrt(np.mean(alone))), float(scatter / np.sqrt(np.mean(alike)))


def false_alarms(before: list[MatrixResponses], after: list[MatrixResponses]) -> Floats:
    """Share of healthy pairs below each of `ALPHAS`."""
    probability = np.array([compare_matrices(*pair).probability for pair in zip(before, after)])
    return np.array([np.mean(probability < alpha) for alpha in ALPHAS])


def named(before: list[MatrixResponses], part: str, seed: int) -> tuple[float, float, float]:
    """Shares of trials that name the changed part first, and alone; and with the amount inside its 95 % bound."""
    field, value = next(iter(CHANGES[part].items()))
    after = matrices(replace(GANTRY, **CHANGES[part]), len(before), np.random.default_rng(seed))
    first, alone, inside = [], [], []
    for pair in zip(before, after):
        causes = compare_gantries(*pair, GANTRY).causes
        first.append(bool(causes) and causes[0].part == part)
        alone.append(first[-1] and len(causes) == 1)
        if first[-1]:
            inside.append(abs(causes[0].amount - (value - getattr(GANTRY, field))) < causes[0].bound)
    return float(np.mean(first)), float(np.mean(alone)), float(np.mean(inside))


def moved(before: list[MatrixResponses], seed: int) -> tuple[float, float, float]:
    """With the cart 0.1 m beside: recognised where that is not specified; and false alarms without and with it."""
    after = matrices(replace(GANTRY, cart_m=0.3), len(before), np.random.default_rng(seed))
    unsaid = [compare_gantries(*pair, GANTRY) for pair in zip(before, after)]
    specified = [compare_gantries(*pair, GANTRY, cart_m=(0.2, 0.3)) for pair in zip(before, after)]
    recognised = [bool(one.causes) and one.causes[0].part == CART_PLACE for one in unsaid]
    return (*(float(np.mean(x)) for x in (recognised, [one.changed for one in unsaid])),
            float(np.mean([one.changed for one in specified])))  # fmt: skip


def main(words: list[str]) -> int:
    runs = int(words[0]) if words else RUNS
    before, after = (matrices(GANTRY, runs, np.random.default_rng(seed)) for seed in (1, 2))
    for machine, measured in ((GANTRY, before), (COREXY, corexy_matrices(runs, 4))):
        right, inside, scatter = modes(measured, machine)
        print(Verdict(f"{type(machine).__name__}: structures that are right", right, 0.95, at_least=True))
        print("covered by 95 % bounds of frequency and damping of each mode, %:", (100 * inside).round(1).tolist())
        print("their scatter over the stated sigma:", scatter.round(2).tolist())
        print(Verdict("points from 95 %, mean of all", float(100 * abs(inside.mean() - 0.95)), 2.0))
        print(
            Verdict("points from 95 %, worst quantity", float(100 * np.abs(inside - 0.95).max()), 2.0, why=WIDE),
            flush=True,
        )
    for share in BEGINS:
        alone, alike = begun(runs, share)
        print(f"excitation begins at {share:g} of its period: scatter of the yaw stiffness over stated sigma "
              f"{alike:.2f}, with independent lines {alone:.2f}", flush=True)  # fmt: skip
    said, epsilon, inside = lacking(before)
    print(f"the mode at 71 Hz lacking: ε {100 * epsilon:.2g} %, covered, %:", (100 * inside).round(1).tolist())
    print(Verdict("the same: fits that say that ± is not a 95 % bound", said, 0.95, at_least=True), flush=True)
    covered = 100 * parameters(before)
    print("physical parameters covered by 95 % bounds, %:", covered.round(1).tolist())
    print(Verdict("points from 95 %, mean of all parameters", float(abs(covered.mean() - 95)), 2.0), flush=True)
    for alpha, share in zip(ALPHAS, false_alarms(before, after)):
        chance = 2 * (alpha * (1 - alpha) / runs) ** 0.5
        print(Verdict(f"share of false alarms where {alpha:g} is stated", float(share), alpha + chance), flush=True)
    for seed, part in enumerate(CHANGES):
        first, alone, amount = named(before, part, 10 + seed)
        print(Verdict(f"{part} named first ({100 * alone:.0f} % alone)", first, 0.95, at_least=True))
        print(Verdict("the same: amount inside its 95 % bound", amount, 0.93, at_least=True), flush=True)
    recognised, unsaid, specified = moved(before, 30)
    print(Verdict("cart moved by 0.1 m, not specified: recognised", recognised, 0.95, at_least=True))
    print(Verdict("the same: alarms of a part of the machine", unsaid, 0.01 + 2 * (0.01 / runs) ** 0.5))
    print(Verdict("the same, specified: alarms", specified, 0.01 + 2 * (0.01 / runs) ** 0.5))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
