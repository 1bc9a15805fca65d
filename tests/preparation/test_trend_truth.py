"""A signal that drifts: its trend is the moving mean over a window, and is subtracted where it matters at a line.

Truths are closed forms and the exact periodic steady state. Statistical bounds are three standard deviations or more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import livebode as lb
from livebode.configuration import Axis
from livebode.core import Block, Lines
from livebode.estimation import Settings
from livebode.excitation import multisine, slow_part
from livebode.preparation import AlignedLog, TrendSearch, trend_of
from livebode.runtime import Destination, run
from livebode.sources import open_log
from tests.support.command import write_parquet

RATE_HZ, WINDOW, PERIODS = 1000.0, 100, 20
LINES = Lines.of_bins((1, 2, 3, 5, 8, 13, 21), WINDOW, RATE_HZ)
PLANT = 1 / (LINES.z - 0.9)
T = np.arange(WINDOW * PERIODS) / WINDOW
DRIFTS = {"ramp": 50 * T, "parabola": 3 * T**2 - T, "settling": 20 * np.exp(-T / 4), "sine": 3 * np.sin(2 * T)}


def signals(noise: float = 0.01, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Twenty periods of a plant with a pole, in its periodic steady state, and white noise in y."""
    period = multisine(LINES, 1.0)
    spectrum = np.fft.rfft(period)
    spectrum[list(LINES.bins)] *= PLANT
    y = np.tile(np.fft.irfft(spectrum, WINDOW), PERIODS)
    return np.tile(period, PERIODS), y + noise * np.random.default_rng(seed).standard_normal(y.size)


def tracked(folder: Path, u: np.ndarray, y: np.ndarray, **tracking: Any) -> lb.Run:
    folder.mkdir(exist_ok=True)
    log = write_parquet(folder / "log.parquet", {"t": np.arange(y.size) / RATE_HZ, "u": u, "y": y})
    sections = {
        "source": {"log": log},
        "signals": {"output": "y", "input": "u"},
        "tracking": {"estimator": "direct", "average": True} | tracking,
    }
    return lb.Run(run(Axis.of(sections, "test"), Destination(folder / "run", lambda *_: None, force=True)).directory)


def errors(found: lb.Run) -> np.ndarray:
    return np.abs(found.average.value - PLANT) / found.average.sigma


@given(st.integers(3, 60), st.integers(3, 9), st.tuples(*[st.floats(-1e3, 1e3)] * 3), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_a_parabola_of_any_size_vanishes_and_what_repeats_remains(
    period: int, periods: int, parts: tuple[float, float, float], seed: int
) -> None:
    repeats = np.tile(np.random.default_rng(seed).standard_normal(period), periods)
    t = np.arange(repeats.size) / period
    x = repeats + parts[0] + parts[1] * t + parts[2] * t**2
    rest = x - slow_part(x, period)
    assert np.ptp(rest - repeats) <= 1e-12 * (1 + np.abs(parts).sum() * periods**2) * repeats.size


@pytest.mark.parametrize(("line", "share"), [(1, 0.03), (2, 0.13), (3, 0.02), (9, 0.01)])
def test_white_noise_at_a_line_grows_by_less_than_stated(line: int, share: float) -> None:
    # The variance of a line of the middle window over unit noise in each sample of seven periods, exactly.
    period = 40
    each = np.eye(7 * period)
    rest = np.array([x - slow_part(x, period) for x in each])
    line_of = np.exp(-2j * np.pi * line * np.arange(period) / period)
    variance = np.sum(np.abs(rest[:, 3 * period : 4 * period] @ line_of) ** 2)
    assert abs(variance / period - 1) <= share
    mean = np.sum(np.abs(rest @ np.tile(line_of, 7) / 7) ** 2)
    assert 7 * mean / period <= 1.1  # of seven, and only by its ends


@given(st.integers(3, 12), st.floats(0.05, 0.4), st.floats(0, 6), st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_a_wander_below_the_lowest_line_vanishes_and_lines_remain(
    lowest: int, part: float, phase: float, seed: int
) -> None:
    period, periods = 120, 16
    spectrum = np.zeros(period // 2 + 1, dtype=np.complex128)
    rng = np.random.default_rng(seed)
    spectrum[lowest:30] = rng.standard_normal(30 - lowest) + 1j * rng.standard_normal(30 - lowest)
    repeats = np.tile(np.fft.irfft(spectrum, period), periods)
    wander = np.sin(2 * np.pi * part * min(lowest, 8) * np.arange(repeats.size) / period + phase)
    x = repeats + 10 * wander
    rest = x - slow_part(x, period, lowest)
    lines = np.fft.rfft((rest - repeats).reshape(periods, period), axis=1)[:, lowest:30]
    leak = np.fft.rfft(10 * wander.reshape(periods, period), axis=1)[:, lowest:30]
    inner = slice(2, -2)  # what begins before the signal is not known: the ends
    assert np.abs(lines[inner]).max() < 0.05 * max(np.abs(leak).max(), 1.0)  # one of a period has no leak
    # What is left is in the first and last windows, and so in the scatter.
    assert np.abs(lines.mean(axis=0)).max() <= np.abs(lines).max() / 3


@dataclass(frozen=True, eq=False)
class CutLog(AlignedLog):
    """A recording in Blocks of another length."""

    length: int = 1

    def blocks(self, channels: Sequence[str] | None = None) -> Iterator[Block]:
        for block in super().blocks(channels):
            yield from (block.cut(i, min(i + self.length, len(block))) for i in range(0, len(block), self.length))


@pytest.mark.parametrize("length", [7, 100, 1000])
def test_the_trend_does_not_depend_on_how_the_samples_are_cut(length: int, tmp_path: Path) -> None:
    _, y = signals()
    y = y + DRIFTS["sine"] + np.cumsum(np.random.default_rng(1).standard_normal(y.size)) / 30
    y = np.tile(y, 3) + np.repeat([0, y[-1], 2 * y[-1]], y.size)
    log = open_log(write_parquet(tmp_path / "a.parquet", {"t": np.arange(y.size) / RATE_HZ, "y": y}))
    found = trend_of(CutLog(log, (), 0, length), ["y"], LINES).of(["y"], 0, y.size)[0]
    assert np.abs(found - slow_part(y, WINDOW)).max() < 0.05 * np.std(y[:WINDOW])  # between its values it is a cubic


def test_a_change_of_what_repeats_is_no_trend() -> None:
    # The gain changes by a tenth over the recording: a line k loses less than 1.1/πk of the change in a period.
    period, periods = 120, 20
    t = np.arange(period * periods) / period
    for line in (3, 5, 9, 20):
        x = (1 + 0.1 * t / t[-1]) * np.cos(2 * np.pi * line * t)
        trend = slow_part(x, period, line)[2 * period : -2 * period].reshape(-1, period)
        assert np.abs(np.fft.rfft(trend, axis=1)[:, line]).max() < 1.1 * 0.1 / periods / (np.pi * line) * period / 2


@pytest.mark.parametrize("name", DRIFTS)
def test_a_drifting_output_gives_the_response_within_its_bounds(name: str, tmp_path: Path) -> None:
    u, y = signals()
    plain, drifting = tracked(tmp_path / "plain", u, y), tracked(tmp_path / "drifting", u, y + DRIFTS[name])
    assert "trend-subtracted" not in [event.kind for event in plain.events]
    (event,) = [event for event in drifting.events if event.kind == "trend-subtracted"]
    assert "'y' drifts by" in event.message
    assert drifting.summary["found"]["trend_subtracted"] == ["y"]
    assert drifting.average.valid.all()
    assert errors(drifting).max() < 3.1  # 7 lines: once in 2,000 runs
    wider = drifting.average.sigma if name != "sine" else drifting.average.noise
    # A period of the sine is three windows: (π/3)⁴/36 of it remain. They are variation, too: next test.
    assert np.median(wider / plain.average.sigma) < (1.2 if name != "sine" else 10)


def test_the_bound_covers_what_remains_of_a_wander_in_63_percent_of_the_windows_and_is_no_wider(tmp_path: Path) -> None:
    """A quantile of 20 windows has a standard deviation of a tenth."""
    u, y = signals()
    found = tracked(tmp_path, u, y + DRIFTS["sine"]).average
    rest = DRIFTS["sine"] - slow_part(DRIFTS["sine"], WINDOW)
    spectra = (np.fft.rfft(x.reshape(PERIODS, WINDOW))[:, list(LINES.bins)] for x in (rest, u))
    remains = np.quantile(np.abs(np.divide(*spectra)), 0.632, axis=0)
    np.testing.assert_allclose(found.sigma, np.hypot(remains, found.noise), rtol=0.3)


def test_a_differenced_channel_keeps_its_trend_and_so_does_one_that_is_configured_so(tmp_path: Path) -> None:
    u, y = signals()
    found = tracked(tmp_path / "differenced", u, y + DRIFTS["ramp"], differenced=["y"])
    assert "trend_subtracted" not in found.summary["found"]
    assert errors(found).max() < 3.1
    kept = tracked(tmp_path / "kept", u, y + 0.05 * DRIFTS["ramp"], trend="keep")
    assert kept.events == []
    subtracted = tracked(tmp_path / "subtracted", u, y + 0.05 * DRIFTS["ramp"])
    wrong, right = (np.abs(one.average.value - PLANT).max() for one in (kept, subtracted))
    assert wrong > 20 * right


@pytest.mark.filterwarnings("ignore::livebode.core.SignalWarning")
def test_the_mean_under_a_random_walk_is_covered_as_promised() -> None:
    beyond: list[float] = []
    for seed in range(40):
        u, y = signals(seed=seed)
        walk = np.cumsum(np.random.default_rng(100 + seed).standard_normal(y.size)) * 0.2
        mean = lb.frf(u, y + walk, fs=RATE_HZ)
        beyond += (np.abs(mean.value - PLANT) / mean.sigma).tolist()
    # 280 lines, of which those of a run are correlated: as 40 of 7 alike at worst, ± 7.6 and ± 2.2 %.
    assert np.mean(np.array(beyond) < 1) > 0.63 - 0.15
    assert np.mean(np.array(beyond) < 1.98) > 0.98 - 0.045


def test_noise_alone_has_no_trend() -> None:
    settings_ = Settings(lines=LINES, estimator="direct", input="u", output="y")
    found = 0
    for seed in range(300):
        u, y = signals(noise=10.0, seed=seed)
        search = TrendSearch(settings_, 0)
        search.process(Block(np.array([u, y]), ("u", "y"), RATE_HZ))
        found += bool(search.finish())
    # Three sigma of each of seven lines, of which the lowest are nearly one: 0.3 % to 2 %.
    assert found <= 9
