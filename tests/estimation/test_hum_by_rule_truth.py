"""Hum by rule: an excitation whose sign alternates, and a recording without excitation.

An excitation whose sign alternates every N samples has the period 2N and only odd harmonics of 1/(2N): that is what an
odd design is. What keeps its sign from one half of such a window to the next is in the even bins alone.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from livebode.core import Block, Lines, SignalError
from livebode.estimation import Settings, Tracker, find_hum
from livebode.excitation import multisine, odd_lines, recognise
from tests.support.command import livebode, write_parquet
from tests.support.errors import refused
from tests.support.found import with_events

RATE_HZ, N = 4000.0, 800
ODD = odd_lines(20, 140, RATE_HZ, N, seed=1)  # 5 Hz apart: 50 and 60 Hz are even bins
T = np.arange(40_000) / RATE_HZ


@given(st.lists(st.floats(-1, 1), min_size=8, max_size=40))
def test_a_signal_whose_sign_alternates_has_odd_bins_of_twice_the_period_only(half: list[float]) -> None:
    spectrum = np.fft.rfft(np.concatenate([half, np.negative(half)]))
    np.testing.assert_allclose(spectrum[::2], 0, atol=1e-12)


@given(st.integers(0, 2**20))
@settings(max_examples=20, deadline=None)
def test_an_odd_design_alternates_its_sign_every_half_window(seed: int) -> None:
    lines = odd_lines(20, 140, RATE_HZ, N, seed=seed)
    w = multisine(lines, phases="random", seed=seed)
    np.testing.assert_allclose(w[N // 2 :], -w[: N // 2], atol=1e-12)


def test_a_period_that_is_played_with_alternating_sign_is_found_as_odd_lines_of_twice_its_length() -> None:
    half = multisine(Lines.parse("20:140:10", RATE_HZ, N // 2), phases="random", seed=2)
    half = half * np.hanning(N // 2)  # any samples: the rule asks for nothing but the sign
    found = recognise(np.tile(np.concatenate([half, -half]), 12), RATE_HZ)
    assert found.period == N
    assert all(k % 2 == 1 for k in found.lines.bins)


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
def test_hum_of_any_size_and_phase_changes_no_line_of_an_odd_design(mains_hz: float) -> None:
    w = np.tile(multisine(ODD, phases="random", seed=3), 20)
    y = np.convolve(w, [0.5, 0.3])[: w.size]
    t = np.arange(w.size) / RATE_HZ
    hum = sum(10 * np.cos(2 * np.pi * k * mains_hz * t + k) for k in range(1, 11))
    clean, humming = (_tracked(ODD, w, signal) for signal in (y, y + hum))
    assert humming.valid.all(axis=1)[-1]
    np.testing.assert_allclose(humming.value[-1], clean.value[-1], rtol=1e-9)


def _tracked(lines: Lines, w: np.ndarray, y: np.ndarray):
    tracker = Tracker(Settings(lines=lines, output="y", input="u", excitation="w"))
    responses, events = with_events(tracker.process, Block(np.array([w, w, y]), ("w", "u", "y"), RATE_HZ))
    assert events == []
    return responses


@pytest.mark.parametrize("mains_hz", [49.9, 50.0, 60.06])
@pytest.mark.parametrize("seconds", [2.0, 3.0, 10.0])
def test_frequencies_and_amplitudes_of_hum_are_found_in_a_recording_without_excitation(
    mains_hz: float, seconds: float
) -> None:
    rng = np.random.default_rng(4)
    t = T[: round(seconds * RATE_HZ)]
    noise = lfilter([1.0], [1.0, -0.9], rng.standard_normal((2, t.size))) * 1e-2
    y = 0.2 * np.cos(2 * np.pi * mains_hz * t + 1) + 0.1 * np.sin(2 * np.pi * 3 * mains_hz * t) + noise[0] + 5
    u = 0.05 * np.cos(2 * np.pi * mains_hz * t) + 0.1 * noise[1]
    one, three = find_hum({"y": y, "u": u}, RATE_HZ)
    assert one.frequency_hz == pytest.approx(mains_hz, abs=0.3 / seconds)  # a tenth of a bin of a third
    assert three.frequency_hz == pytest.approx(3 * mains_hz, abs=0.3 / seconds)
    assert one.amplitude == pytest.approx({"y": 0.2, "u": 0.05}, rel=0.05)
    assert three.amplitude == pytest.approx({"y": 0.1}, rel=0.08)


def test_noise_of_any_slope_is_not_reported_as_hum() -> None:
    """200 recordings of 20 multiples, each taken for hum by chance less than once in 1e8."""
    rng = np.random.default_rng(5)
    for pole in (-0.9, 0.0, 0.9, 0.999):
        for _ in range(50):
            assert find_hum({"y": lfilter([1.0], [1.0, -pole], rng.standard_normal(4000))}, 1000.0) == []


@pytest.mark.parametrize("damping", [0.01, 0.003])
def test_a_mode_that_rings_out_is_no_hum(damping: float) -> None:
    t = T[:12_000]
    y = np.exp(-damping * 2 * np.pi * 50 * t) * np.cos(2 * np.pi * 50 * t)
    assert find_hum({"y": y + 1e-5 * np.random.default_rng(6).standard_normal(t.size)}, RATE_HZ) == []


@pytest.mark.parametrize(("damping", "seconds", "most"), [(0.005, 3, 12), (0.002, 3, 12), (0.005, 6, 23)])
def test_a_mode_at_the_mains_frequency_that_noise_drives_is_seldom_hum(damping: float, seconds: int, most: int) -> None:
    """100 recordings, of which one in 20 or in eight passes by chance, and three standard deviations more."""
    rng, settled = np.random.default_rng(8), 2000
    pole = np.exp((-damping + 1j) * 2 * np.pi * 50 / 1000)
    noise = rng.standard_normal((100, settled + 1000 * seconds))
    y = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], noise)[:, settled:]
    assert sum(find_hum({"y": recorded}, 1000.0) != [] for recorded in y) <= most


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
def test_hum_whose_amplitude_changes_by_a_fifth_is_found(mains_hz: float) -> None:
    """90 of 100 recordings of three seconds, at frequencies off by up to 0.1 Hz, with changes of 0.1 to 1 Hz."""
    rng, t, found = np.random.default_rng(10), T[:12_000], 0
    for _ in range(100):
        amplitude = 1 + 0.2 * np.sin(2 * np.pi * rng.uniform(0.1, 1) * t + rng.uniform(0, 6))
        hz = mains_hz + rng.uniform(-0.1, 0.1)
        y = amplitude * np.cos(2 * np.pi * hz * t + rng.uniform(0, 6)) + 0.3 * rng.standard_normal(t.size)
        found += [round(hum.frequency_hz) for hum in find_hum({"y": y}, RATE_HZ)] == [mains_hz]
    assert found >= 90


@pytest.mark.parametrize("off_hz", [-1.4, -0.6, 0.6, 1.0])
def test_the_tone_of_a_machine_that_rotates_near_the_mains_is_not_hum(off_hz: float) -> None:
    rng = np.random.default_rng(11)
    for seconds in (2, 3, 10):
        t = T[: round(seconds * RATE_HZ)]
        y = np.cos(2 * np.pi * (50 + off_hz) * t + rng.uniform(0, 6)) + 0.1 * rng.standard_normal(t.size)
        assert find_hum({"y": y}, RATE_HZ) == []


def test_hum_whose_power_noise_changes_by_more_than_a_tenth_is_found() -> None:
    """90 of 100 recordings: none of three thirds may be farther off than by two standard deviations of noise."""
    rng, t = np.random.default_rng(9), T[:12_000]
    y = 0.4 * np.cos(2 * np.pi * 50 * t) + 0.6 * rng.standard_normal((100, t.size))
    assert sum(find_hum({"y": recorded}, RATE_HZ) != [] for recorded in y) >= 90


def test_less_than_two_seconds_is_refused() -> None:
    with refused(SignalError, "too-short", seconds_min=2):
        find_hum({"y": T[:7999]}, RATE_HZ)


def recording(path: Path, silent_s: float, excited_s: float, level: float = 0.1) -> Path:
    rng, lines = np.random.default_rng(7), Lines.parse("30:130:20", RATE_HZ, 400)
    w = np.tile(multisine(lines), round(excited_s * 10))
    w = np.concatenate([w, np.zeros(round(silent_s * RATE_HZ))])
    t = np.arange(w.size) / RATE_HZ
    hum = level * np.cos(2 * np.pi * 50 * t)
    u, y = w + 0.3 * hum, 2 * w + hum
    columns = {"w": w} | {name: x + 1e-3 * rng.standard_normal(w.size) for name, x in (("u", u), ("y", y))}
    return write_parquet(path, columns)


LINES = ("--rate", 4000, "--lines", "30:130:20", "--window", 400)
SIGNALS = ("--output", "y", "--input", "u")


@pytest.mark.parametrize("excited_s", [0.0, 3.0])
def test_inspect_names_the_hum_and_the_lines_that_it_disturbs(excited_s: float, tmp_path: Path) -> None:
    log = recording(tmp_path / "log.parquet", 4.0, excited_s)
    shown = livebode("inspect", log, *LINES, *SIGNALS, "--excitation", "w")
    assert shown.code == 0, shown.err
    assert "hum of the mains in 4 s without excitation" in shown.out
    assert "a response at 50 Hz would contain the hum" in shown.out
    found = json.loads(livebode("inspect", log, *LINES, *SIGNALS, "--excitation", "w", "--json").out)
    (hum,) = found["without_excitation"]["hum"]
    assert hum["frequency_hz"] == pytest.approx(50, abs=0.05)
    assert hum["amplitude"] == pytest.approx({"y": 0.1, "u": 0.03}, rel=0.01)
    assert hum["disturbed_lines_hz"] == [50.0]
    assert ("excitation" in found) == (excited_s > 0)


def test_a_silent_recording_with_a_missing_value_is_looked_at(tmp_path: Path) -> None:
    log = recording(tmp_path / "log.parquet", 6.0, 0.0)
    columns = {name: pq.read_table(log)[name].to_numpy().copy() for name in "wuy"}
    columns["y"][15_000] = np.nan
    shown = livebode("inspect", write_parquet(log, columns), *LINES, *SIGNALS, "--excitation", "w")
    assert shown.code == 0, shown.err
    assert "hum of the mains in 3.75 s without excitation" in shown.out


def test_hum_is_shown_where_the_excitation_is_not_recognised(tmp_path: Path) -> None:
    log = recording(tmp_path / "log.parquet", 4.0, 0.0)
    columns = {name: pq.read_table(log)[name].to_numpy().copy() for name in "wuy"}
    columns["w"][-4000:] = np.random.default_rng(3).standard_normal(4000)
    shown = livebode("inspect", write_parquet(log, columns), *LINES, *SIGNALS, "--excitation", "w")
    assert shown.code == 0, shown.err
    assert "hum of the mains in 3 s without excitation" in shown.out
    assert "The excitation is not recognised" in shown.out


def test_inspect_reports_that_hum_was_not_found_or_could_not_be_judged(tmp_path: Path) -> None:
    quiet = recording(tmp_path / "quiet.parquet", 4.0, 0.0, level=0.0)
    assert "no hum of the mains is visible in 4 s" in livebode("inspect", quiet, *LINES, *SIGNALS).out
    excited = recording(tmp_path / "excited.parquet", 0.5, 3.0)
    refused = livebode("inspect", excited, *LINES, *SIGNALS, "--excitation", "w")
    assert (refused.code, "'w' pauses for 0.5 s at most" in refused.err) == (2, True)
    for missing, words in (
        (LINES, "give --output"),
        (("--lines", "50", "--output", "y"), "--lines and --window need each other"),
        (("--input", "u"), "give --output, --lines and --window too"),
        (("--output", "y"), "give --excitation, or --lines and --window"),
    ):
        refused = livebode("inspect", quiet, *missing)
        assert (refused.code, words in refused.err) == (2, True), refused.err
