"""Periods without excitation show hum of the mains; what rings on after the excitation is not hum."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from livebode.core import Block, Event, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine, odd_lines
from tests.support.found import with_events

RATE_HZ, N = 4000.0, 400
LINES = Lines.of_bins([3, 5, 7, 11, 13], N, RATE_HZ)  # 50 Hz is one of the lines
W = multisine(LINES, phases="random", seed=1)
ON_MAINS = int(np.flatnonzero(LINES.frequency_hz == 50)[0])
CHANNELS = ("w", "u", "y")


def excitation(*periods: int) -> np.ndarray:
    """That many periods with excitation, without, with …"""
    return np.concatenate([np.tile(W if i % 2 == 0 else 0 * W, n) for i, n in enumerate(periods)])


def ringing(w: np.ndarray, hz: float, damping: float) -> np.ndarray:
    """A mode of this frequency and damping ratio beside a gain of 1."""
    pole = np.exp((-damping + 1j) * 2 * np.pi * hz / RATE_HZ)
    return w + 0.05 * lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], w)


def hum(samples: int, level: float) -> np.ndarray:
    return level * np.cos(2 * np.pi * 50 * np.arange(samples) / RATE_HZ + 0.7)


def tracked(w: np.ndarray, y: np.ndarray) -> tuple[Responses, list[Event]]:
    noise = 1e-3 * np.random.default_rng(2).standard_normal(w.size)
    return with_events(new().process, Block(np.array([w, w, y + noise]), CHANNELS, RATE_HZ))


def new() -> Tracker:
    return Tracker(Settings(lines=LINES, output="y", input="u", excitation="w", hop=100))


@pytest.mark.parametrize("damping", [0.02, 0.005, 0.001])
@pytest.mark.parametrize("hz", [50.0, 50.7])
@pytest.mark.parametrize("silent", [4, 30])
def test_a_mode_that_rings_on_at_the_mains_frequency_is_not_hum(damping: float, hz: float, silent: int) -> None:
    w = excitation(30, silent, 20)
    responses, events = tracked(w, ringing(w, hz, damping))
    assert "hum" not in [event.kind for event in events]
    assert responses.valid[-1, ON_MAINS]


@pytest.mark.parametrize("silent", [2, 4])
@pytest.mark.parametrize("damping", [0.01, 0.002])
def test_a_mode_that_rings_where_the_data_begins_is_not_hum(silent: int, damping: float) -> None:
    w = excitation(0, silent, 5)
    begun = np.concatenate([[100.0], np.zeros(w.size - 1)])
    _, events = tracked(w, w + ringing(begun, 50.5, damping))
    assert events == []


@pytest.mark.parametrize(("silent", "kinds"), [(3, []), (4, ["hum"])])
def test_hum_where_the_data_begins_is_found_in_three_whole_periods_behind_the_first(
    silent: int, kinds: list[str]
) -> None:
    w = excitation(0, silent, 5)
    assert [event.kind for event in tracked(w, w + hum(w.size, 0.1))[1]] == kinds


def test_hum_under_a_mode_that_rings_on_is_found_once_that_has_died_away() -> None:
    w = excitation(30, 30, 20)
    y = ringing(w, 50.7, 0.02) + hum(w.size, 0.1)
    responses, events = tracked(w, y)
    assert [event.kind for event in events] == ["hum"]
    assert not responses.valid[-1, ON_MAINS]


@pytest.mark.parametrize("pieces", [1, 3])
def test_hum_that_a_later_silence_does_not_show_is_withdrawn(pieces: int) -> None:
    w = excitation(10, 12, 20, 4, 20)
    y = w + hum(w.size, 0.1) * (np.arange(w.size) < 30 * N)
    noise = 1e-3 * np.random.default_rng(2).standard_normal(w.size)
    whole = Block(np.array([w, w, y + noise]), CHANNELS, RATE_HZ)
    edges = np.linspace(0, w.size, pieces + 1).astype(int)
    tracker, found, events = new(), [], []
    for start, stop in pairwise(edges):  # restored in the first silence, and after the hum
        again = new()
        again.restore(tracker.snapshot())
        tracker = again
        found.append(tracker.process(whole.cut(start, stop), events.append))
    responses = Responses.join(found)
    assert not responses.valid[responses.sample == 41 * N - 1, ON_MAINS].any()
    assert responses.valid[-1, ON_MAINS]
    assert [event.kind for event in events] == ["hum", "hum-gone"]
    assert tracker.found()["judged"]["invalid_lines_hz"] == {}


def test_hum_that_a_later_silence_shows_at_two_fifths_of_its_amplitude_is_still_hum() -> None:
    w = excitation(10, 12, 20, 6, 5)
    level = np.where(np.arange(w.size) < 30 * N, 1.0, 0.4)
    responses, events = tracked(w, w + level * hum(w.size, 0.1))
    assert [event.kind for event in events] == ["hum"]
    assert not responses.valid[-1, ON_MAINS]


@pytest.mark.parametrize("silent", [1.0, 0.5, 0.0])
def test_an_excitation_that_begins_again_at_another_phase_begins_the_mean_again(silent: float) -> None:
    lines = odd_lines(20, 140, RATE_HZ, 800, seed=1)
    period = multisine(lines, phases="random", seed=1)
    before, pause = np.tile(period, 20), np.zeros(int(silent * 800))
    w = np.concatenate([before, pause, np.tile(np.roll(period, 137), 21)])[: 40 * 800]
    block = Block(np.array([w, w, w + 0.02 * np.roll(w, 1) ** 3]), CHANNELS, RATE_HZ)
    trackers = [Tracker(Settings(lines=lines, output="y", input="u", excitation="w")) for _ in range(2)]
    for tracker, start in zip(trackers, (0, (20 + (silent > 0)) * 800 - 1)):
        tracker.process(block.cut(start, len(block)))
    ours, theirs = (tracker.found()["judged"]["distortion"] for tracker in trackers)
    assert ours == pytest.approx(theirs, rel=1e-6)
