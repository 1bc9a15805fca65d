"""Fits: processor time of one, in C and by the NumPy path that every other model takes, and by SciPy, in one run.

SciPy's least_squares starts from the same values with the same model in closed form. The last lines are what a live run
does with a response: fit, derived quantities and, with a loop, margins.

python -m bench.fits
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from livebode.configuration import FitSection
from livebode.core import PID, Lines, Loop, Responses
from livebode.fitting import EvaluationGrid, Fitter, TwoMass, fit_each, two_masses
from livebode.runtime import Fits
from livebode_plant.fleet.alike_axes import process_together

TARGET_US = 60.0
RATE_HZ, AXES, TARGET_AXES, LIVE = 200, 16, 8, 32
LINES = Lines.parse("20:120:5", rate_hz=4000, window=800)
MODEL = TwoMass(radius_m=0.019)
TRUTH = np.array([0.0028, 6.7, 5.0e5, 130.0, 0.0, 0.0, 0.0])
ROWS, REPEATS = 200, 3
SIGMA = 0.005  # of |G|
LOOP = Loop(feedback=PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000, delay_ticks=2))


class NumpyTwoMass(TwoMass):
    """The same model as a user's own, which NumPy fits."""


def responses(seed: int = 0) -> Responses:
    """Two masses whose stiffness varies by 20 %, with noise at 21 lines."""
    rng = np.random.default_rng(seed)
    values = np.repeat(TRUTH[np.newaxis], ROWS, axis=0)
    values[:, 2] *= 1 + 0.2 * np.sin(np.linspace(0, 2 * np.pi, ROWS))
    truth = MODEL.at(values, EvaluationGrid.of(LINES))
    sigma = SIGMA * np.abs(truth)
    value = truth + sigma * (rng.standard_normal(truth.shape) + 1j * rng.standard_normal(truth.shape)) / np.sqrt(2)
    ones, rows = np.ones(truth.shape), np.arange(ROWS)
    return Responses(
        lines=LINES, value=value, sigma=sigma, dof=np.full(ROWS, np.inf), coherence=ones, valid=ones > 0,
        first=20 * rows, sample=20 * rows + 799, time_s=0.005 * rows, schedule=np.full(ROWS, np.nan),
    )  # fmt: skip


def ours(model: TwoMass, batch: int) -> Callable[[], float]:
    """Seconds per fit if responses arrive `batch` at a time: warm, after the first sixteen."""
    every = responses()

    def run() -> float:
        fitter = Fitter(model)
        fitter.process(every[:16])
        times = []
        for first in range(16, ROWS, batch):
            part = every[first : first + batch]
            start = time.thread_time()
            found = fitter.process(part)
            times.append((time.thread_time() - start) / len(part))
            assert found.ok.all()
        return statistics.median(times)

    return run


def axes_together(model: TwoMass, axes: int) -> Callable[[], float]:
    """Seconds per fit if each of many axes has one new response: warm, in one computation."""
    every = responses()

    def run() -> float:
        fitters = [Fitter(model) for _ in range(axes)]
        fit_each(fitters, [every[:16]] * axes)
        times = []
        for i in range(16, 26):
            start = time.thread_time()
            found, _errors = fit_each(fitters, [every[i : i + 1]] * axes)
            times.append((time.thread_time() - start) / axes)
            assert all(found[axis].ok.all() for axis in range(axes))
        return statistics.median(times)

    return run


def live(model: TwoMass, loop: Loop | None, axes: int) -> float:
    """Seconds per response of what a live run does with each: fit, derived quantities, margins; groups included."""
    every = responses()
    members = [Fits(FitSection(model="two-mass", radius_m=0.019, side="motor"), loop) for _ in range(axes)]
    for one in members:
        one.fitter("").model = model
        one.process(every[:16])
    start = time.thread_time()
    for i in range(16, 16 + LIVE):
        process_together(members, [every[i : i + 1]] * axes)
    return (time.thread_time() - start) / LIVE / axes


def scipys() -> float:
    """Seconds per fit of SciPy's Levenberg–Marquardt, each from the previous result, with the same closed form."""
    every, arm = responses(), 2 * np.log(MODEL.radius_m or 1.0)
    start = np.log(TRUTH[:4]) + np.array([0.0, arm, arm, arm])
    weight = np.sqrt(2) / every.sigma
    times = []
    for i in range(16, 116):

        def rest(x: np.ndarray, i: int = i) -> np.ndarray:
            e = weight[i] * (two_masses.sampled(x, LINES.z, LINES.rate_hz) - every.value[i])
            return np.concatenate([e.real, e.imag])

        begun = time.thread_time()
        start = least_squares(rest, start, method="lm").x
        times.append(time.thread_time() - begun)
    return statistics.median(times)


def main() -> None:
    native, numpy_ = MODEL, NumpyTwoMass(radius_m=0.019)
    print(
        "two masses at 21 lines, warm, values with covariance and status; processor time, median, least of the rounds"
    )
    ways: dict[str, Callable[[TwoMass], Callable[[], float]]] = {
        f"{batch} at a time": lambda model, batch=batch: ours(model, batch) for batch in (1, 16, 100)
    }
    ways |= {f"{axes} axes, one response each": lambda m, axes=axes: axes_together(m, axes) for axes in (16, 100)}
    theirs = min(scipys() for _ in range(3))
    for name, way in ways.items():
        runs = way(native), way(numpy_)
        new, old = np.min([[run() for run in runs] for _ in range(REPEATS)], axis=0)
        verdict = f"target ≤ {TARGET_US:g} µs: {'met' if 1e6 * new <= TARGET_US else 'missed'}"
        print(f"{name:30}{1e6 * new:7.1f} µs, NumPy {old / new:5.1f} ×, SciPy {theirs / new:5.1f} ×   {verdict}")
    print(f"{'SciPy least_squares':30}{1e6 * theirs:7.1f} µs")
    for name, loop in (("fit and derived quantities", None), ("and margins", LOOP)):
        for axes in (1, AXES):
            new, old = np.min([[live(model, loop, axes) for model in (native, numpy_)] for _ in range(2)], axis=0)
            count = 1 / new / RATE_HZ
            verdict = f"target ≥ {TARGET_AXES}: {'met' if count >= TARGET_AXES else 'missed'}"
            what = f"{name}, {axes} at once"
            print(
                f"{what:38}{1e6 * new:7.1f} µs, NumPy {old / new:5.1f} ×, {count:5.1f} axes a core at 200/s   {verdict}"
            )


if __name__ == "__main__":
    main()
