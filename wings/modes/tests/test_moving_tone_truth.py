"""A tone whose frequency moves is told from a mode, and its windows have no modes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from livebode_modes.moving_tone import moving_tone
from tests.support.command import livebode, write_parquet

RATE_HZ, BAND_HZ, SAMPLES = 250.0, (20.0, 100.0), 1000
MODE_HZ = 47.0


def resonating(force: np.ndarray, damping: float, rate_hz: float = RATE_HZ, hz: float = MODE_HZ) -> np.ndarray:
    pole = np.exp(2 * np.pi * hz * complex(-damping, np.sqrt(1 - damping**2)) / rate_hz)
    return np.asarray(lfilter([1.0, -1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force))


@pytest.mark.parametrize("slope_hz_s", [-6.0, 0.5, 2.0, 8.0])
@pytest.mark.parametrize("noise", [0.0, 0.4])
def test_a_linear_sweep_is_found_with_its_frequencies(slope_hz_s: float, noise: float) -> None:
    t = np.arange(SAMPLES) / RATE_HZ
    y = np.sin(2 * np.pi * (60 + slope_hz_s / 2 * t) * t) + noise * np.random.default_rng(1).standard_normal(SAMPLES)
    tone = moving_tone(y, RATE_HZ, BAND_HZ)
    assert tone is not None
    assert (tone.from_hz, tone.to_hz) == pytest.approx((60, 60 + 4 * slope_hz_s), abs=0.5)


@pytest.mark.parametrize("damping", [0.01, 0.05])
def test_a_logarithmic_sweep_is_found_on_both_sides_of_a_resonance_and_at_it(damping: float) -> None:
    t, rate = np.arange(7500) / RATE_HZ, np.log(4) / 30
    y = resonating(np.sin(2 * np.pi * 25 * np.expm1(rate * t) / rate), damping)
    found = [moving_tone(y[i : i + SAMPLES], RATE_HZ, BAND_HZ) for i in range(0, 6500, 500)]
    assert sum(tone is not None for tone in found) >= len(found) - 1


@pytest.mark.parametrize("damping", [0.002, 0.005, 0.01, 0.03, 0.1])
def test_no_mode_under_noise_is_a_moving_tone(damping: float) -> None:
    """80 windows each; a probability of 2 % would give none of 400 with a probability of 3e-4."""
    rng = np.random.default_rng(round(1e4 * damping))
    windows = resonating(rng.standard_normal(81 * SAMPLES), damping).reshape(81, SAMPLES)[1:]
    assert not any(moving_tone(window, RATE_HZ, BAND_HZ) for window in windows)


def test_a_run_on_a_sweep_names_the_tone_and_the_remedy_and_no_mode(tmp_path: Path) -> None:
    t, rng = np.arange(12_000) / 500.0, np.random.default_rng(2)
    force = np.sin(2 * np.pi * (25 + 1.5 * t) * t) + 0.02 * rng.standard_normal(t.size)
    y = resonating(force, 0.02, 500.0) + 0.01 * rng.standard_normal(t.size)
    log = write_parquet(tmp_path / "sweep.parquet", {"t": t, "u": force, "velocity": y})
    done = livebode("run", log, "--output-only", "--output", "velocity", "--band", "20:100", "--out", tmp_path / "run")
    assert (done.code, done.err) == (0, "")
    assert "a tone moves between" in done.out
    assert "--input CHANNEL --estimator lpm" in done.out
    summary = json.loads((tmp_path / "run" / "run.json").read_text("utf-8"))
    assert summary["modes"] == summary["harmonics"] == []
    assert summary["moving_tones"][0]["low_hz"] < 40
    events = [json.loads(line)["kind"] for line in (tmp_path / "run" / "events.jsonl").read_text("utf-8").splitlines()]
    assert events == ["moving-tone"]
    remedy = livebode(
        "run", log, "--input", "u", "--output", "velocity", "--estimator", "lpm", "--out", tmp_path / "response"
    )
    assert remedy.code == 0, remedy.err
