"""Welch's estimate against the truth, in closed loop, with bounds that hold away from the resonance.

600 lines of 755 averages: coverage of 63 % to ± 2 % (one standard deviation).
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.signal import chirp

from livebode.core import LivebodeError, SignalError
from livebode.estimation import welch
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.errors import refused


@cache
def record(sigma: float) -> np.ndarray:
    """Rows w, u, y."""
    w = np.random.default_rng(5).standard_normal(400_000)
    u, y = TwoMassLoop().run(w, periods=1, sigma=sigma, seed=6)
    return np.array([w, u[0], y[0]])


def test_joint_bounds_hold_in_closed_loop_where_the_response_is_smooth() -> None:
    found = welch(*record(0.1), fs=RATE_HZ, window=1000)
    smooth = (found.lines.frequency_hz > 250) & (found.lines.frequency_hz < 1900)
    error = np.abs(found.value - TwoMassPlant().response(found.lines.frequency_hz))[smooth]
    assert np.mean(error <= found.bound(1)[smooth]) == pytest.approx(0.632, abs=0.06)
    assert np.mean(error <= found.bound(2)[smooth]) == pytest.approx(0.982, abs=0.02)


def test_h1_is_biased_in_closed_loop() -> None:
    smooth = slice(100, 400)
    truth = TwoMassPlant().response(np.arange(1, 500) * RATE_HZ / 1000)[smooth]
    joint, h1 = (
        np.mean(welch(*signals, fs=RATE_HZ, window=1000).value[smooth] / truth)
        for signals in (record(0.1), record(0.1)[1:])
    )
    assert abs(joint - 1) < 0.02 < abs(h1 - 1)


def test_welch_of_a_chirp_in_closed_loop_is_the_plant() -> None:
    t = np.arange(20_000) / RATE_HZ
    w = 2.0 * chirp(t, 5.0, t[-1], 250.0)
    u, y = TwoMassLoop().run(w, periods=1)
    found = welch(w, u[0], y[0], fs=RATE_HZ, window=4000, overlap=0.75)
    band = (found.lines.frequency_hz > 15) & (found.lines.frequency_hz < 200)
    truth = TwoMassPlant().response(found.lines.frequency_hz[band])
    db = 20 * np.log10(np.abs(found.value[band] / truth))
    assert np.median(np.abs(db)) < 0.2
    assert np.median(found.coherence[band]) > 0.99


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"window": 300_000}, "signal.too-short"),
        ({"overlap": 1.0}, "usage.out-of-range"),
        ({"fs": -1}, "usage.out-of-range"),
    ],
)
def test_recordings_and_settings_without_a_welch_average_are_refused(change: dict, code: str) -> None:
    with pytest.raises(LivebodeError) as caught:
        welch(*record(0.1), **({"fs": RATE_HZ, "window": 1000} | change))
    assert caught.value.code == code


def test_samples_that_are_not_finite_are_refused() -> None:
    data = record(0.1)[:, :5000].copy()
    data[2, 77] = np.nan
    with refused(SignalError, "not-finite"):
        welch(*data, fs=RATE_HZ, window=1000)
