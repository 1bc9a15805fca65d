"""A machine that changes within a recording: coverage of matrices, and of local polynomials under noise.

`python -m studies.variation_matrix [--runs 200] [--seed 1000] [--kinds "matrix,lpm,gantry"]` has the table of
`studies.variation` for a machine with two inputs and two outputs, each entry with a change of its own, and noise that
both outputs share in part; and for a machine under noise that does not repeat, by the estimator "lpm". Each is averaged
over windows and with `--average`. "mean" is the share of the errors of the mean over the recording within one and two
of its standard deviations (`mean` and `mean_sigma` of run.json), and "noise" the part of the noise in sigma over that.
At the end: how many recordings of the simulated gantry of `studies.matrix_monitoring`, in closed loop and at rest, are
reported.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Block, Channel, Lines, MatrixResponses
from livebode.estimation import NonPeriodicTracker, Settings
from livebode.excitation import MatrixExcitation
from livebode.fitting import (
    Drift,
    MatrixDriftTest,
    Repetitions,
    RunningMean,
    matrix_with_drift,
    mean_matrix,
)
from livebode_matrix import MatrixSettings, MatrixTracker
from studies.matrix_change import GANTRY
from studies.matrix_monitoring import TORQUE_N_M, monitored
from studies.variation import Course, changes, linear, rest, step

RATE_HZ, NOISE, LPM_NOISE, MOMENTS = 1000.0, 0.1, 0.045, 100  # with about the same noise in a window
REPETITIONS, PERIODS = 40, {"dwell": 2, "settle": 1}
MATRIX_LINES = Lines.parse("20:140:20", RATE_HZ, 200)
EXCITATION = MatrixExcitation.orthogonal(MATRIX_LINES, 2, **PERIODS)
SHARED = np.array([[1.0, 0.0], [0.8, 0.6]])  # of the noise of the outputs
LPM_LINES, LPM_WINDOWS = Lines.parse("20:400:20", RATE_HZ, 500), 60
TAPS = 3
SIGNALS = {"output": ("y1", "y2"), "input": ("u1", "u2"), "excitation": ("w1", "w2")}
CASES = (rest, linear, step)
HEADER = (
    "change",
    "estimate",
    "average",
    "reported",
    "1 sigma",
    "2 sigma",
    "mean 1",
    "mean 2",
    "width",
    "noise",
    "variation",
)


@dataclass(frozen=True)
class Result:
    """Of one recording: the mean with its sigma, the test, and the truth; values of any number of entries."""

    value: Complex
    sigma: Floats
    noise: Floats
    drift: Drift
    begin: Complex
    change: Complex
    course: Course

    def response(self, share: Floats) -> Complex:
        """(moments, values)."""
        return np.asarray(self.begin + np.outer(self.course(share), self.change))


def matrix(case: Callable[[np.random.Generator], Course], rng: np.random.Generator, *, average: bool) -> Result:
    """Two inputs in open loop; each entry has a response of its own at each line, and its change."""
    w = np.tile(EXCITATION.samples, REPETITIONS)
    n, lines = np.arange(w.shape[1]), len(MATRIX_LINES)
    course = case(rng)
    begin = rng.uniform(0.2, 3, (lines, 2, 2)) * np.exp(2j * np.pi * rng.uniform(size=(lines, 2, 2)))
    change = changes(rng, begin)
    turn = np.exp(2j * np.pi * np.outer(MATRIX_LINES.bins, n) / MATRIX_LINES.window)
    of_experiment = EXCITATION.spectra.transpose(2, 1, 0) / 1j  # amplitudes of sines
    dwell = PERIODS["dwell"] * MATRIX_LINES.window
    waves = of_experiment[:, :, n // dwell % 2] * turn[:, np.newaxis]
    now = begin[..., np.newaxis] + change[..., np.newaxis] * course((n + 0.5) / n.size)
    y = np.einsum("koin,kin->on", now, waves).real + NOISE * SHARED @ rng.standard_normal((2, n.size))
    memory = REPETITIONS if average else 6
    options: dict[str, Any] = SIGNALS | PERIODS
    settings = MatrixSettings(lines=MATRIX_LINES, hop=MATRIX_LINES.window, average=average, memory=memory, **options)
    channels = tuple(map(Channel, ("y1", "y2", "u1", "u2", "w1", "w2")))
    responses = MatrixTracker(settings).process(Block(np.vstack([y, w, w]), channels, RATE_HZ))
    test = drift_test(responses)
    drift = test.result()
    mean = matrix_with_drift(responses.newest(), drift) if average else mean_matrix(responses)
    noise = np.sqrt(mean.noise_variance)
    return Result(mean.value.ravel(), mean.sigma.ravel(), noise.ravel(), drift, begin.ravel(), change.ravel(), course)


def drift_test(responses: MatrixResponses) -> MatrixDriftTest:
    """The test on all of these matrices."""
    lines, outputs, inputs = responses.value.shape[1:]
    test = MatrixDriftTest((lines, outputs, inputs), responses.lines.rate_hz, Repetitions.of(responses))
    test.add(responses)
    return test


def lpm(case: Callable[[np.random.Generator], Course], rng: np.random.Generator, *, average: bool) -> Result:
    """Noise as input; the plant and its change are short filters."""
    n = np.arange(LPM_LINES.window * LPM_WINDOWS)
    course, u = case(rng), rng.standard_normal(n.size + TAPS)
    delayed = np.array([u[TAPS - tap : TAPS - tap + n.size] for tap in range(TAPS)])
    begin = rng.standard_normal(TAPS)
    change = rng.uniform(0.01, 0.1) * rng.standard_normal(TAPS)
    y = begin @ delayed + course((n + 0.5) / n.size) * (change @ delayed) + LPM_NOISE * rng.standard_normal(n.size)
    settings = Settings(
        lines=LPM_LINES, output="y", input="u", estimator="lpm", average=average, forgetting=1.0, hop=LPM_LINES.window
    )
    mean = RunningMean()
    mean.add(NonPeriodicTracker(settings).process(Block(np.array([u[TAPS:], y]), tuple(map(Channel, "uy")), RATE_HZ)))
    response = mean.response()[0]
    turns = np.exp(-2j * np.pi * np.outer(LPM_LINES.frequency_hz / RATE_HZ, np.arange(TAPS)))
    drift = mean.drift.result()
    return Result(response.value, response.sigma, response.noise, drift, turns @ begin, turns @ change, course)


KINDS = {"matrix": matrix, "lpm": lpm}


def row(kind: str, case: Callable[[np.random.Generator], Course], average: bool, seeds: range) -> tuple[str, ...]:
    """A row of the table, by `HEADER`."""
    reported, within, mean_within, width, noise, variation = 0, [], [], [], [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        of = KINDS[kind](case, rng, average=average)
        reported += of.drift.significant
        distance = np.sort(np.abs(of.response(rng.uniform(size=MOMENTS)) - of.value), axis=0)
        within.append([np.mean(distance < c * of.sigma) for c in (1, 2)])
        over = np.linspace(0, 1, 2001)
        error = np.abs(of.response(over).mean(axis=0) - of.drift.value)
        mean_within.append([np.mean(error < c * of.drift.mean_sigma) for c in (1, 2)])
        noise.append(of.noise / of.drift.mean_sigma)
        width.append(of.sigma / np.maximum(distance[62], distance[97] / 2))
        if case is not rest:
            variation.append(of.drift.rms / (np.std(of.course(over)) * np.abs(of.change)))
    shares = [f"{100 * share:.1f} %" for share in (*np.mean(within, axis=0), *np.mean(mean_within, axis=0))]
    return (
        case.__name__,
        kind,
        "yes" if average else "no",
        f"{100 * reported / len(seeds):.1f} %",
        *shares,
        f"{np.median(width):.2f}",
        f"{np.median(noise):.2f}",
        "" if case is rest else f"{np.median(variation):.2f}",
    )


def gantry_at_rest(runs: int, seed: int, torque_n_m: float) -> int:
    """How many recordings of 30 repetitions in closed loop are reported, with a random torque of this rms."""
    rng, reported = np.random.default_rng(seed), 0
    for _ in range(runs):
        reported += drift_test(monitored([(GANTRY, 30)], rng, torque_n_m)).result(whole=True).significant
    return reported


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--kinds", default="matrix,lpm,gantry")
    options = parser.parse_args(arguments)
    kinds = options.kinds.split(",")
    print(f"{options.runs} recordings a case")
    print("  ".join(f"{cell:>9}" for cell in HEADER))
    seeds = range(options.seed, options.seed + options.runs)
    for kind in (kind for kind in KINDS if kind in kinds):
        for case in CASES:
            for average in (False, True):
                print("  ".join(f"{cell:>9}" for cell in row(kind, case, average, seeds)), flush=True)
    if "gantry" in kinds:
        for name, torque_n_m in (("white noise", 0.0), ("and a coloured torque", TORQUE_N_M)):
            found = gantry_at_rest(options.runs, options.seed, torque_n_m)
            print(f"gantry in closed loop at rest, {name}: {found} of {options.runs} recordings reported")


if __name__ == "__main__":
    main()
