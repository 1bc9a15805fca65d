"""Periods that are `alike` are those of which `unlike` marks none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.excitation import alike, cut, spectra, unlike

WINDOW, BINS = 120, (2, 5, 6, 11)
EXCITED = np.isin(np.arange(WINDOW // 2), BINS)


def recorded(seed: int, noise: float, drift: float, fault: str) -> np.ndarray:
    """Periods of a multisine with noise, a drift and a fault."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(8, 65))
    at = np.arange(count * WINDOW) / WINDOW
    x = sum(np.cos(2 * np.pi * k * at + k * k) for k in BINS) + noise * rng.standard_normal(at.size)
    x += drift * np.interp(at, np.linspace(0, count, 5), rng.standard_normal(5))
    period = int(rng.integers(0, count)) * WINDOW
    size = 10.0 ** rng.uniform(-3, 1)
    if fault == "spike":
        x[period + int(rng.integers(0, WINDOW))] += size
    elif fault == "transient":
        x += size * np.exp(-at / 2)
    elif fault == "pause":
        x[period : period + WINDOW] *= 1 - size / 10
    elif fault == "missing":
        x[period + 3] = np.nan
    return x.reshape(count, WINDOW)


def is_alike(periods: np.ndarray) -> bool:
    with np.errstate(all="ignore"):
        return alike(periods, lambda: spectra(periods, EXCITED), BINS)


@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 1e-13, 1e-9, 1e-3, 0.1, 3.0]),
    st.sampled_from([0.0, 0.1, 30.0]),
    st.sampled_from(["", "spike", "transient", "pause", "missing"]),
)
@settings(deadline=None, max_examples=300)
def test_no_period_of_alike_ones_is_unlike(seed: int, noise: float, drift: float, fault: str) -> None:
    periods = recorded(seed, noise, drift, fault)
    if is_alike(periods):
        assert not unlike(cut(periods.ravel(), WINDOW), EXCITED).any()


@pytest.mark.parametrize("noise", [1e-6, 1e-2, 1.0])
def test_periods_with_the_usual_noise_are_alike(noise: float) -> None:
    alike_ones = [is_alike(recorded(seed, noise, 0.0, "")) for seed in range(50)]
    assert np.mean(alike_ones) > 0.8


def test_a_period_that_differs_is_seen() -> None:
    assert not any(is_alike(recorded(seed, 1e-3, 0.0, "missing")) for seed in range(20))
