"""The modes of simulated machines from their outputs alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtri

from livebode.core import Block, Event, Parameters
from livebode_modes import ModeTracker, OutputOnlySettings, Tracks, WindowModes, reduced
from livebode_modes.output_only_settings import window_of
from tests.support.ringing import DAMPING, FREQUENCY_HZ, RATE_HZ, moving_mode, two_modes

Floats = NDArray[np.float64]


def settings(outputs: int = 1, hop_samples: int = 50) -> OutputOnlySettings:
    names = tuple(f"y{i}" for i in range(outputs))
    return OutputOnlySettings(names, RATE_HZ, (2.0, 50.0), reduced(RATE_HZ, 50.0), hop_samples)


def windows(y: Floats, of: OutputOnlySettings, events: list[Event] | None = None) -> list[WindowModes]:
    block = Block(np.atleast_2d(y), of.outputs, of.rate_hz)
    return ModeTracker(of).process(block, (lambda _: None) if events is None else events.append)


def tracked(found: list[WindowModes], of: OutputOnlySettings) -> dict[str, Parameters]:
    tracks, rows = Tracks(of.hops), dict[str, list[Parameters]]()
    for parts in [*map(tracks.process, found), tracks.finish()]:
        for part in parts:
            rows.setdefault(part.model, []).append(part)
    return {name: Parameters.join(parts) for name, parts in rows.items()}


@pytest.mark.parametrize("outputs", [1, 2])
def test_bounds_of_two_modes_under_white_noise_cover_the_errors(outputs: int) -> None:
    """100 windows of 20 hops: the 63 % bounds cover 0.53 … 0.71, the 98 % bounds at least 0.92 of the errors.

    Twenty hops give sigma itself a scatter of 16 %; four standard deviations of a count of 400 are 0.09.
    """
    of = settings(outputs, hop_samples=200)
    y = two_modes(outputs, (of.hop_samples * of.hops + of.lags) * 100, outputs)
    errors = []
    for part in np.split(y, 100, axis=1):
        (window,) = windows(part, of)
        assert len(window.modes) == 2
        for mode, f, z in zip(window.modes, FREQUENCY_HZ, DAMPING):
            error = np.array([mode.frequency_hz - f, mode.damping - z])
            errors.append(error / np.sqrt(np.diagonal(mode.covariance)))
    covered = [np.mean(np.abs(errors) < ndtri(0.5 + p / 2)) for p in (0.632, 0.982)]
    assert 0.53 < covered[0] < 0.71
    assert covered[1] > 0.92
    # No bias: the mean error of 100 windows, and the scatter of the errors is that which sigma states.
    assert np.abs(np.mean(np.reshape(errors, (100, -1)), axis=0)).max() < 4 / np.sqrt(100)
    assert 0.8 < np.std(errors) < 1.4


def test_a_frequency_that_moves_is_one_curve_within_its_bounds() -> None:
    rate_hz, seconds = 150.0, 180.0
    truth_hz = np.linspace(25.6, 41.5, int(rate_hz * seconds))
    y = moving_mode(1, truth_hz, 0.02, rate_hz)
    of = OutputOnlySettings(("y",), rate_hz, (5.0, 60.0), 1)
    rows = tracked(windows(y, of), of)
    assert list(rows) == ["mode 1"]
    mode = rows["mode 1"]
    expected = np.interp(mode.time_s, np.arange(truth_hz.size) / rate_hz, truth_hz)
    error, sigma = mode["frequency"] - expected, mode.sigma[:, 0]
    assert mode.ok.mean() > 0.95
    assert (expected.min(), expected.max()) == pytest.approx((25.6, 41.5), abs=0.5)
    assert np.sqrt(np.nanmean(error**2)) < 0.01 * 33
    assert np.abs(np.nanmean(error)) < 0.1
    assert np.mean(np.abs(error[mode.ok]) < 1.96 * sigma[mode.ok]) > 0.85
    assert np.nanmean(mode["damping"]) == pytest.approx(0.02, abs=0.004)


def test_a_line_of_constant_amplitude_is_a_harmonic_and_not_a_mode() -> None:
    of = settings(hop_samples=100)
    y = two_modes(3, 6000)
    rotation = 0.7 * y.std() * np.sin(2 * np.pi * 38.3 * np.arange(y.shape[1]) / RATE_HZ)
    rows = tracked(windows(y + rotation, of), of)
    assert sorted(rows) == ["harmonic 1", "mode 1", "mode 2"]
    assert np.nanmedian(rows["harmonic 1"]["frequency"]) == pytest.approx(38.3, abs=0.1)
    assert rows["harmonic 1"].names == ("frequency", "share")
    for i, (f, z) in enumerate(zip(FREQUENCY_HZ, DAMPING), 1):
        assert np.nanmedian(rows[f"mode {i}"]["frequency"]) == pytest.approx(f, abs=0.5)
        assert np.nanmedian(rows[f"mode {i}"]["damping"]) == pytest.approx(z, abs=0.006)


def test_a_free_decay_has_the_frequencies_and_dampings_of_its_modes() -> None:
    rng, t = np.random.default_rng(4), np.arange(1600) / RATE_HZ
    decays = [np.exp(-z * 2 * np.pi * f * t) * np.sin(2 * np.pi * f * t) for f, z in ((30, 0.003), (47, 0.005))]
    y = decays[0] + 0.5 * decays[1] + 0.001 * rng.standard_normal(t.size)
    of = settings()
    first = windows(y, of)[0]
    assert [mode.frequency_hz for mode in first.modes] == pytest.approx([30, 47], abs=0.01)
    assert [mode.damping for mode in first.modes] == pytest.approx([0.003, 0.005], rel=0.02)
    assert not first.harmonics


def test_noise_has_no_modes() -> None:
    of = settings(hop_samples=50)
    rng = np.random.default_rng(5)
    found = [windows(rng.standard_normal(1100), of)[0] for _ in range(40)]
    assert sum(len(window.modes) + len(window.harmonics) for window in found) <= 2


def test_shares_of_power_and_shapes_are_those_of_the_modes() -> None:
    of = settings(outputs=2, hop_samples=400)
    window = windows(two_modes(6, 8200, 2, noise=0.01), of)[0]
    truth = np.array([1 + 0.36, 0.64 + 1]) / (1 + 0.36 + 0.64 + 1)
    assert [mode.share for mode in window.modes] == pytest.approx(truth, abs=0.08)
    ratios = [mode.shape[1] / mode.shape[0] for mode in window.modes]
    assert np.real(ratios) == pytest.approx([0.6, -1 / 0.8], rel=0.05)


def test_time_and_schedule_of_a_row_are_those_of_the_centre_of_its_window() -> None:
    of = OutputOnlySettings(("y",), 1000.0, (2.0, 50.0), 8, 20, 12, schedule="at")
    rng = np.random.default_rng(7)
    at = 5.0 + np.arange(6000) / 1000.0
    block = Block([rng.standard_normal(6000), at], ("y", "at"), 1000.0, origin_s=5.0)
    found = ModeTracker(of).process(block)
    assert len(found) > 5
    assert [window.schedule for window in found] == pytest.approx([window.time_s for window in found], abs=1e-9)
    newest_s = 5.0 + np.array([window.sample for window in found]) / 1000.0
    behind_s = newest_s - np.array([window.time_s for window in found])
    assert np.all((behind_s > of.window / 2000) & (behind_s < of.window / 2000 + (of.lags + 21) * 0.008))


def test_missing_samples_are_a_gap_in_the_rows_and_the_curve_continues_after_it() -> None:
    of = settings(hop_samples=50)
    y = two_modes(8, 8000)
    y[:, 4000:4600] = np.nan
    events: list[Event] = []
    rows = tracked(windows(y, of, events), of)
    assert [event.kind for event in events] == ["non-finite"]
    assert [name for name, row in rows.items() if row.ok.sum() > 40] == ["mode 1", "mode 2"]
    mode = rows["mode 1"]
    assert set(mode.status) >= {"ok", "gaps"}
    gap = mode.status == "gaps"
    assert np.isnan(mode.value[gap]).all()
    assert not gap[0]
    assert not gap[-1]


def test_windows_start_again_after_a_gap_that_is_longer_than_a_window() -> None:
    of = settings(hop_samples=50)
    tracker, y = ModeTracker(of), two_modes(9, 4200)
    before = tracker.process(Block(y[:, :2100], of.outputs, RATE_HZ))
    after = tracker.process(Block(y[:, 2100:], of.outputs, RATE_HZ, start=10_000_000_000, gap=True))
    assert len(after) == len(before) == (2100 - of.lags) // 50 - 19
    assert all(window.status == "ok" for window in after)
    assert after[0].time_s - before[0].time_s == pytest.approx(1e10 / RATE_HZ)


@pytest.mark.parametrize(("samples", "hops"), [(100_000, 20), (16_000, 20), (1_300, 10)])
def test_the_default_window_fits_into_the_recording(samples: int, hops: int) -> None:
    hop_samples, found = window_of(8, None, None, samples, 160)
    assert found == hops
    assert hop_samples * found * 8 <= max(samples // 2, 960)
