"""The study of distortion finds what is known: squares at even lines, cubes at odd ones, and nothing that fed back."""

from __future__ import annotations

import numpy as np
import pytest

from livebode import Block
from studies.common import RATE_HZ
from studies.levels import GROUP, PERIOD, RMS_N_M, odd_multisine_lines, period_of, rest

LINES = odd_multisine_lines()
EVERY = np.arange(LINES.bins[0], LINES.bins[-1] + 1)
EVEN, ODD = EVERY % 2 == 0, (EVERY % 2 == 1) & ~np.isin(EVERY, LINES.bins)


def periods(u: np.ndarray, y: np.ndarray, count: int = 2) -> Block:
    return Block(np.tile([u, y], count), ("u", "velocity"), RATE_HZ)


@pytest.mark.parametrize("seed", [None, 0, 7])
def test_the_excitation_is_odd_with_odd_detection_lines_and_the_specified_rms(seed: int | None) -> None:
    period = period_of(LINES, seed)
    assert np.sqrt(np.mean(period**2)) == pytest.approx(RMS_N_M)
    size = np.abs(np.fft.rfft(period))
    assert np.allclose(size[list(LINES.bins)], size[LINES.bins[0]])
    assert size[list(LINES.quiet)].max() < 1e-9 * size[LINES.bins[0]]
    assert np.count_nonzero(ODD) == pytest.approx((len(LINES) + np.count_nonzero(ODD)) / GROUP, abs=1)


@pytest.mark.parametrize(("power", "seen", "empty"), [(2, EVEN, ODD), (3, ODD, EVEN)])
def test_squares_are_even_and_cubes_are_odd(power: int, seen: np.ndarray, empty: np.ndarray) -> None:
    u = period_of(LINES, 1)
    response, mean, noise, _, _ = rest(periods(u, 3 * u + 0.01 * u**power), LINES)
    expected = np.abs(np.fft.rfft(0.01 * u**power)[EVERY]) * 2 / PERIOD
    assert np.allclose(np.abs(mean[seen]), expected[seen], rtol=1e-3)
    assert np.abs(mean[empty]).max() < 1e-6 * np.abs(mean[seen]).max()
    assert np.abs(response / 3 - 1).max() < 0.2
    assert noise.max() < 1e-20


def test_distortion_that_was_fed_back_is_subtracted() -> None:
    w, n = period_of(LINES, 2), np.arange(PERIOD)
    disturbance = 0.02 * np.sin(2 * np.pi * 50 * n / PERIOD) + 0.03 * np.sin(2 * np.pi * LINES.quiet[0] * n / PERIOD)
    y = (2 * w + disturbance) / (1 + 2 * 0.5)  # y = 2·u + disturbance, u = w − y/2
    _, mean, _, _, _ = rest(periods(w - 0.5 * y, y), LINES)
    found = np.abs(mean[[50 - EVERY[0], LINES.quiet[0] - EVERY[0]]])
    assert found == pytest.approx([0.02, 0.03], rel=1e-9)
    assert np.abs(np.fft.rfft(y)[50]) * 2 / PERIOD == pytest.approx(0.01, rel=1e-9)


def test_noise_is_the_scatter_of_one_period() -> None:
    u, sigma, count = period_of(LINES, 3), 0.1, 200
    rng = np.random.default_rng(0)
    block = Block(np.array([np.tile(u, count), np.tile(u, count) + sigma * rng.standard_normal(count * PERIOD)]),
                  ("u", "velocity"), RATE_HZ)  # fmt: skip
    _, _, noise, _, _ = rest(block, LINES)
    # 4σ²/PERIOD for a complex amplitude; 157 lines of 199 degrees of freedom leave 0.6 % to chance.
    assert noise.mean() == pytest.approx(4 * sigma**2 / PERIOD, rel=0.03)
