"""The bounds hold what they promise: 400 noisy closed-loop runs at standstill.

Statistical bounds: 2,800 (run, line) give a coverage of 63 % to ± 0.9 % (one standard deviation) and one of 98 % to
± 0.3 %. At the 60 Hz line, next to the resonance, sigma is too high and about 80 % lie within it for N = 400: what the
noise moves rings from one window into the next, which widens the scatter between periods but not the mean over them.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from livebode.core import PID, Block, Cascade, Lines, Loop, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import KPC, KVC, RATE_HZ, TI

RUNS, SIGMA = 400, 0.1
PERIODS = 10
FEEDBACK = Cascade(
    PID(gain=KVC, integral_time_s=TI, rate_hz=RATE_HZ), PID(gain=KPC, rate_hz=RATE_HZ / 2, rate_divider=2)
)


def lines_of(window: int) -> Lines:
    return Lines.parse("20:140:20", rate_hz=RATE_HZ, window=window)


@cache
def records(window: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Excitation, input and output of all runs, from the state in which the noise has been there for long."""
    w = multisine(lines_of(window))
    settled = 4 * window
    u, y = TwoMassLoop().run(w, 4 + PERIODS, SIGMA, RUNS, seed=20)
    return np.tile(w, PERIODS), u[:, settled:], y[:, settled:]


@cache
def responses(
    window: int, estimator: str, noise: str = "periods", average: bool = True, apart: int = 1
) -> list[Responses]:
    w, u, y = records(window)
    settings = Settings(
        lines=lines_of(window),
        output="y",
        input="u",
        excitation="w",
        estimator=estimator,
        loop=Loop(FEEDBACK),
        hop=apart * window,
        average=average,
        forgetting=1.0,
        noise=noise,
    )
    blocks = (Block(np.array([w, u[i], y[i]]), ("w", "u", "y"), RATE_HZ) for i in range(RUNS))
    return [Tracker(settings).process(block) for block in blocks]


def errors(window: int, found: list[Responses], periods: int) -> np.ndarray:
    truth = TwoMassPlant().response(lines_of(window).frequency_hz)
    return np.array([np.abs(r.value[periods - 1] - truth) for r in found])


def within(window: int, found: list[Responses], periods: int) -> np.ndarray:
    """Whether the truth is within one and two times sigma, shape (2, runs, lines)."""
    radii = np.array([[r.bound(c)[periods - 1] for r in found] for c in (1, 2)])
    return errors(window, found, periods) <= radii


@pytest.mark.parametrize("window", [400, 800])
@pytest.mark.parametrize("estimator", ["joint", "indirect"])
def test_coverage_from_four_periods_on(window: int, estimator: str) -> None:
    found = responses(window, estimator)
    hits = np.array([within(window, found, m) for m in range(4, PERIODS + 1)])
    shares = hits.mean(axis=(0, 2, 3))
    at_60_hz = hits[:, 0, :, 2].mean()
    print(f"N={window} {estimator}: within 1 sigma {shares[0]:.4f} (60 Hz {at_60_hz:.3f}), within 2 {shares[1]:.4f}")
    assert shares[0] == pytest.approx(0.63, abs=0.03)
    assert shares[1] == pytest.approx(0.98, abs=0.01)


@pytest.mark.parametrize("window", [400, 800])
@pytest.mark.parametrize("estimator", ["joint", "indirect"])
def test_variance_against_the_cramer_rao_bound(window: int, estimator: str) -> None:
    # N·σ²/|U|² for one period, with U of the noise-free periodic state.
    u, _ = TwoMassLoop().run(multisine(lines_of(window)), 1)
    bound = window * SIGMA**2 / np.abs(np.fft.fft(u[0])[list(lines_of(window).bins)]) ** 2
    away = lines_of(window).frequency_hz != 60.0  # the resonance is at 61 Hz
    found = responses(window, estimator)
    for periods in (4, 6, PERIODS):
        share = np.mean(errors(window, found, periods) ** 2, axis=0) / (bound / periods)
        # 400 runs give the variance of a line to 5 %; the mean of the six lines away to 2 %.
        print(
            f"N={window} {estimator}, {periods} periods: variance {share[away].mean():.3f} of the bound away from the "
            f"resonance (largest line {share[away].max():.3f}), {share.mean():.3f} over all lines"
        )
        assert share[away].mean() <= 1.10
        assert share.mean() <= 1.15


def test_single_windows_are_covered_too() -> None:
    found = responses(400, "joint", average=False)
    shares = within(400, found, 10).mean(axis=(1, 2))
    assert shares[0] == pytest.approx(0.63, abs=0.04)
    assert shares[1] == pytest.approx(0.98, abs=0.015)


def test_windows_further_apart_are_covered_too() -> None:
    # As from a drive that sends seldom: two periods apart, what rings at 60 Hz is gone, and sigma is right there too.
    found = responses(400, "joint", average=True, apart=2)
    hits = within(400, found, 5)
    print(f"two windows apart: {hits[0].mean():.4f} (60 Hz {hits[0, :, 2].mean():.3f}), {hits[1].mean():.4f}")
    assert hits[0].mean() == pytest.approx(0.63, abs=0.03)
    assert hits[0, :, 2].mean() == pytest.approx(0.63, abs=0.06)
    assert hits[1].mean() == pytest.approx(0.98, abs=0.01)


def test_bounds_from_detection_lines_cover_the_truth_and_are_somewhat_wide() -> None:
    # The larger of two estimates, of which one is high near the resonance, so coverage may only be high.
    found = responses(400, "joint", noise="quiet")
    shares = within(400, found, 4).mean(axis=(1, 2))
    assert 0.60 <= shares[0] <= 0.80
    assert 0.97 <= shares[1] <= 1.0


def test_direct_is_biased_in_closed_loop_and_joint_is_not() -> None:
    # Noise of 3 rad/s: feedback then makes much of u, and direct sees much of −1/C instead of G.
    lines, periods = lines_of(400), 10
    w = multisine(lines)
    u, y = TwoMassLoop().run(w, 4 + periods, sigma=3.0, runs=200, seed=21)
    record = (np.tile(w, periods), u[:, 1600:], y[:, 1600:])
    truth = TwoMassPlant().response(lines.frequency_hz)
    bias = {}
    for estimator in ("direct", "joint"):
        options = Settings(
            lines=lines,
            output="y",
            input="u",
            excitation="w",
            estimator=estimator,
            hop=400,
            average=True,
            forgetting=1.0,
        )
        blocks = (
            Block(np.array([record[0], record[1][i], record[2][i]]), ("w", "u", "y"), RATE_HZ) for i in range(200)
        )
        found = np.array([Tracker(options).process(block).value[-1] for block in blocks])
        # In standard errors of the mean over the runs; the largest of 14 normal numbers is below 4.
        spread = np.std(found, axis=0) / np.sqrt(len(found))
        bias[estimator] = np.max(np.abs(np.mean(found, axis=0) - truth) / spread)
    assert bias["joint"] < 4
    assert bias["direct"] > 5


def test_coherence_is_that_of_the_noise() -> None:
    # γ² = 1/(1 + n/s) with n/s the noise-to-signal power of one window at the output.
    _, _, y = records(400)
    y0 = TwoMassLoop().run(multisine(lines_of(400)), 1)[1][0]
    bins = list(lines_of(400).bins)
    signal = np.abs(np.fft.fft(y0)[bins]) ** 2
    noisy = np.fft.fft(y.reshape(RUNS, -1, 400), axis=2)[:, :, bins]
    expected = signal / (signal + np.var(noisy, axis=(0, 1)))
    found = np.mean([r.coherence[9] for r in responses(400, "joint")], axis=0)
    # What chance adds to an estimate from ten periods, (1 − γ²)/10, is taken off.
    assert np.allclose(1 - found, 1 - expected, rtol=0.1)
