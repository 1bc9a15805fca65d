"""Faults of a sensor that repeat: spikes are subtracted with their sizes, an output that stands still is refused.

Truths are the spikes that were added, and the exact periodic steady state. Statistical bounds are three standard
deviations or more.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import livebode as lb
from livebode.configuration import Axis
from livebode.core import Block, Lines, SignalError
from livebode.estimation import RepeatedSpikes, SensorSpikes, Settings
from livebode.excitation import multisine
from livebode.preparation import FaultSearch
from livebode.runtime import Destination, run
from tests.support.command import write_parquet

RATE_HZ, WINDOW, PERIODS = 1000.0, 200, 20
LINES = Lines.of_bins((1, 2, 3, 5, 8, 13, 21, 34), WINDOW, RATE_HZ)
PLANT = 1 / (LINES.z - 0.9)
SETTINGS = Settings(lines=LINES, output="y", input="u", estimator="direct")
STEP = 2e-3


def signals(noise: float = 2e-3, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Input and output of a plant with a pole in its periodic steady state; the output, of size 1, has white noise."""
    period = multisine(LINES, 1.0, "random", seed=seed)
    spectrum = np.fft.rfft(period)
    spectrum[list(LINES.bins)] *= PLANT
    y = np.tile(np.fft.irfft(spectrum, WINDOW), PERIODS)
    scale = float(y.std())
    return np.tile(period / scale, PERIODS), y / scale + noise * np.random.default_rng(seed).standard_normal(y.size)


def stepped(y: np.ndarray) -> np.ndarray:
    return np.round(y / STEP) * STEP


def searched(y: np.ndarray, pieces: int = 1) -> list[SensorSpikes]:
    search, u = FaultSearch(SETTINGS, 0), signals()[0]
    block = Block([u, y], ("u", "y"), RATE_HZ)
    edges = np.linspace(0, y.size, pieces + 1).astype(int)
    for first, stop in pairwise(edges):
        search.process(block.cut(first, stop))
    return search.finish()


def measured(folder: Path, u: np.ndarray, y: np.ndarray) -> lb.Run:
    folder.mkdir(exist_ok=True)
    log = write_parquet(folder / "log.parquet", {"t": np.arange(y.size) / RATE_HZ, "u": u, "y": y})
    sections: dict[str, Any] = {
        "source": {"log": log},
        "signals": {"output": "y", "input": "u"},
        "tracking": {"estimator": "direct", "average": True},
    }
    return lb.Run(run(Axis.of(sections, "test"), Destination(folder / "run", lambda *_: None, force=True)).directory)


def assert_right(found: lb.Run) -> None:
    """Eight lines, 98 % each: two beyond the bound occur once in 90 runs."""
    mean = found.average
    assert mean.valid.all()
    assert np.count_nonzero(np.abs(mean.value - PLANT) > mean.bound(2)) <= 1


@pytest.mark.parametrize(
    "spikes",
    [{17: 5.0}, {17: 0.05}, {40: -3.0, 41: -3.0, 42: -3.0}, {0: 80.0, 199: 80.0, 100: -0.1}, {9: 1.0, 10: -1.0}],
)
def test_spikes_at_the_same_places_of_every_period_are_subtracted(spikes: dict[int, float], tmp_path: Path) -> None:
    u, y = signals()
    added = np.zeros(WINDOW)
    added[list(spikes)] = list(spikes.values())
    spoiled = stepped(y + np.tile(added, PERIODS))
    (found,) = searched(spoiled, pieces=7)
    assert isinstance(found, RepeatedSpikes)
    apart = found.of(0, y.size) - np.tile(added, PERIODS)
    # The median of ten periods has a noise of 0.4 of that of a sample, and a row of spikes 1.5 times that.
    assert np.abs(apart).max() < 5 * 0.6 * np.hypot(2e-3, STEP / 3)
    run_of = measured(tmp_path, u, spoiled)
    assert [event.kind for event in run_of.events] == ["spikes-subtracted"]
    assert_right(run_of)


@pytest.mark.parametrize("turn", [0.37, 1.37, 2.0])
def test_spikes_at_every_turn_are_subtracted(turn: float, tmp_path: Path) -> None:
    u, y = signals()
    spoiled = y.copy()
    spoiled[np.arange(50, y.size, turn * WINDOW).astype(int)] += 20
    run_of = measured(tmp_path, u, stepped(spoiled))
    assert [event.kind for event in run_of.events] == ["spikes-subtracted"]
    assert_right(run_of)
    plain = measured(tmp_path / "plain", u, stepped(y))
    np.testing.assert_allclose(run_of.average.sigma, plain.average.sigma, rtol=0.3)


def test_an_output_that_is_cut_off_is_refused_and_half_the_excitation_is_right(tmp_path: Path) -> None:
    u, y = signals()
    limit = 0.7 * np.abs(y).max()
    with pytest.raises(SignalError, match=r"largest|smallest") as refused:
        measured(tmp_path, u, stepped(np.clip(y, -limit, limit)))
    assert refused.value.code == "signal.output-cut-off"
    assert abs(refused.value.facts["value"]) == pytest.approx(limit, abs=STEP)
    assert_right(measured(tmp_path, u / 2, stepped(np.clip(y / 2, -limit, limit))))


@pytest.mark.parametrize("less", [0.0, 0.1])
def test_an_output_with_a_dead_band_is_refused_and_an_offset_is_right(less: float, tmp_path: Path) -> None:
    u, y = signals()

    def banded(x: np.ndarray) -> np.ndarray:
        return stepped(np.where(np.abs(x) > 0.1, x - less * np.sign(x), 0.0))

    with pytest.raises(SignalError, match="dead band") as refused:
        measured(tmp_path, u, banded(y))
    assert refused.value.code == "signal.output-dead-band"
    assert_right(measured(tmp_path, u, banded(y + 1.2 * np.abs(y).max())))


@pytest.mark.parametrize("step", [0.0, 1e-4, 1e-2, 0.1, 0.5])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-2])
def test_steps_noise_and_friction_are_no_faults(step: float, noise: float) -> None:
    """Fifteen signals of each kind: a smooth one with wide steps stands still at its top, and is not cut off."""
    rng = np.random.default_rng(7)
    for seed in range(5):
        _, y = signals(noise=0.0, seed=seed)
        velocity = np.gradient(y)
        rubbing = y + 0.05 * np.abs(y).max() * np.tanh(velocity / np.abs(velocity).max() / 0.02)
        for x in (y, np.repeat(y[::4], 4), rubbing):
            disturbed = x + noise * rng.standard_normal(x.size)
            assert searched(np.round(disturbed / step) * step if step else disturbed) == []
