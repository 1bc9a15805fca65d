"""Fits: median time, compared with scipy.optimize.least_squares from the same start with the same model.

python -m bench.fits
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from livebode.core import Lines, Responses
from livebode.fitting import EvaluationGrid, Fitter, TwoMass, fit_together, two_masses

TARGET_MS = 0.25
LINES = Lines.parse("20:120:5", rate_hz=4000, window=800)
MODEL = TwoMass(radius_m=0.019)
TRUTH = np.array([0.0028, 6.7, 5.0e5, 130.0, 0.0, 0.0, 0.0])
ROWS, REPEATS = 400, 15
SIGMA = 0.005  # of |G|


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


def ours(batch: int) -> Callable[[], float]:
    """Milliseconds per fit if responses arrive `batch` at a time: warm, after the first sixteen."""
    every = responses()

    def run() -> float:
        fitter = Fitter(MODEL)
        fitter.process(every[:16])
        times = []
        for first in range(16, ROWS, batch):
            part = every[first : first + batch]
            start = time.perf_counter()
            found = fitter.process(part)
            times.append((time.perf_counter() - start) / len(part))
            assert found.ok.all()
        return 1e3 * statistics.median(times)

    return run


def axes_together(axes: int) -> Callable[[], float]:
    """Milliseconds per fit if each of many axes has one new response: warm, in one computation."""
    every = responses()

    def run() -> float:
        fitters = [Fitter(MODEL) for _ in range(axes)]
        fit_together(fitters, [every[:16]] * axes)
        times = []
        for i in range(16, 26):
            start = time.perf_counter()
            found = fit_together(fitters, [every[i : i + 1]] * axes)
            times.append((time.perf_counter() - start) / axes)
            assert all(one.ok.all() for one in found)
        return 1e3 * statistics.median(times)

    return run


def scipys() -> float:
    """Milliseconds per fit of SciPy's Levenberg–Marquardt, each from the previous result, with the same closed form."""
    every, arm = responses(), 2 * np.log(MODEL.radius_m or 1.0)
    start = np.log(TRUTH[:4]) + np.array([0.0, arm, arm, arm])
    weight = np.sqrt(2) / every.sigma
    times = []
    for i in range(16, 116):

        def rest(x: np.ndarray, i: int = i) -> np.ndarray:
            e = weight[i] * (two_masses.sampled(x, LINES.z, LINES.rate_hz) - every.value[i])
            return np.concatenate([e.real, e.imag])

        begun = time.perf_counter()
        start = least_squares(rest, start, method="lm").x
        times.append(time.perf_counter() - begun)
    return 1e3 * statistics.median(times)


def main() -> None:
    print(
        "two masses at 21 lines, warm, values with covariance and status; median of a fit, best of interleaved rounds"
    )
    ways = {f"livebode, {batch} at a time": ours(batch) for batch in (1, 16, 100)}
    ways |= {f"livebode, {axes} axes": axes_together(axes) for axes in (16, 100)}
    ways |= {"scipy least_squares": scipys}
    found = {name: min(way() for _ in range(REPEATS if name[0] == "l" else 3)) for name, way in ways.items()}
    theirs = found["scipy least_squares"]
    for name, ms in found.items():
        verdict = "" if name[0] == "s" else f"target ≤ {TARGET_MS:g} ms: {'met' if ms <= TARGET_MS else 'missed'}"
        print(f"{name:26}{ms:8.3f} ms{theirs / ms:8.1f} × SciPy's speed   {verdict}")


if __name__ == "__main__":
    main()
