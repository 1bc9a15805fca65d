"""Frequency, damping and bounds of damped modes beside a rigid motion, from the output of a simulated belt axis."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from livebode.core import Block
from livebode_modes import Mode, ModeTracker, OutputOnlySettings
from livebode_modes.spectrum import Spectrum, taper

RATE_HZ, BAND_HZ, FREQUENCY_HZ = 500.0, (40.0, 110.0), 67.0
OF = OutputOnlySettings(("y",), RATE_HZ, BAND_HZ, 1, 100)
RUNS = 60


def speed(seed: int, modes: list[tuple[float, float]], samples: int, rigid: float = 1.0) -> np.ndarray:
    """Speed of masses under one white force: each mode, and the rigid motion with its viscous friction."""
    rng = np.random.default_rng(seed)
    force, y = rng.standard_normal(samples + 2000), np.zeros(samples + 2000)
    for hz, damping in modes:
        pole = np.exp(2 * np.pi * hz * complex(-damping, np.sqrt(1 - damping**2)) / RATE_HZ)
        y += lfilter([1.0, -1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
    y += rigid * lfilter([1.0], [1.0, -0.98], force)
    return np.asarray(y[2000:] + 0.01 * rng.standard_normal(samples))


def window(y: np.ndarray) -> tuple[Mode, ...]:
    return ModeTracker(OF).process(Block(np.atleast_2d(y), OF.outputs, RATE_HZ))[0].modes


@pytest.mark.parametrize("damping", [0.02, 0.07])
def test_a_damped_mode_is_one_mode_whose_bounds_cover_it(damping: float) -> None:
    """60 windows: 95 % bounds cover at least 87 %, three standard deviations of the count less; no bias."""
    found = [window(speed(1000 + seed, [(FREQUENCY_HZ, damping)], OF.window + OF.lags)) for seed in range(RUNS)]
    one = [modes[0] for modes in found if len(modes) == 1]
    assert len(one) >= 0.95 * RUNS
    errors = np.array([
        ((m.frequency_hz - FREQUENCY_HZ), (m.damping - damping)) / np.sqrt(np.diagonal(m.covariance)) for m in one
    ])  # fmt: skip
    assert np.all(np.mean(np.abs(errors) < 1.96, axis=0) >= 0.87)
    assert np.all(np.abs(errors.mean(axis=0)) < 4 / np.sqrt(RUNS))


def test_two_damped_modes_remain_two() -> None:
    pairs = [(FREQUENCY_HZ, 0.04), (1.3 * FREQUENCY_HZ, 0.04)]
    found = [window(speed(2000 + seed, pairs, OF.window + OF.lags, rigid=0.3)) for seed in range(20)]
    assert sum(len(modes) == 2 for modes in found) >= 18


def test_the_expected_periodogram_of_a_mode_is_the_mean_of_periodograms() -> None:
    """300 windows of one mode: each bin of the mean has a standard deviation of 6 %, the mean of 40 bins of 1 %."""
    size, gain, hz, damping = 500, np.ones(251), 60.0, 0.01
    weights, powers = taper(np.ones(10, dtype=np.bool_), 50), []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        pole = np.exp(2 * np.pi * hz * complex(-damping, np.sqrt(1 - damping**2)) / RATE_HZ)
        force = rng.standard_normal(size + 3000) + 1j * rng.standard_normal(size + 3000)
        powers.append(Spectrum(lfilter([1.0], [1.0, -pole], force)[3000:].real, weights, RATE_HZ, gain).power)
    region = slice(40, 80)
    spectrum = Spectrum(np.zeros(size), weights, RATE_HZ, gain)
    (cosine, _), _ = spectrum.expected(hz, damping, region)
    ratio = np.mean(powers, axis=0)[region] / cosine
    assert np.std(ratio / ratio.mean()) < 0.09
