"""A response that varies periodically is named with its frequency; noise, hum, a drift and a step are not."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from livebode.core import Event, Lines
from livebode.estimation import PeriodicVariation

LINES = Lines.parse("20:140:10", 4000, 400)
WINDOW_S, WINDOW = 0.1, 400
NOISE = 0.02  # of the response, in a window
Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def windows(seed: int, count: int, change: np.ndarray | float = 0.0) -> Rows:
    """Windows one after the other, with noise; the change of the response at each line."""
    noise = np.random.default_rng(seed).standard_normal((2, count, len(LINES))) * NOISE / np.sqrt(2)
    input_ = np.full((count, len(LINES)), 2 + 1j)
    time_s = np.arange(count) * WINDOW_S
    value = 1j * (1 + noise[0] + 1j * noise[1] + change)
    return np.stack([value * input_, input_]), time_s, np.full(count, np.nan), np.arange(count) * WINDOW + 399


def varying(seed: int, count: int, frequency_hz: float, amplitude: float) -> np.ndarray:
    """Of each line between a fifth and the whole of an amplitude, averaged over a window."""
    size = amplitude * np.random.default_rng(seed).uniform(0.2, 1, len(LINES)) * np.sinc(frequency_hz * WINDOW_S)
    return np.outer(np.cos(2 * np.pi * frequency_hz * np.arange(count) * WINDOW_S), size)


def events_of(rows: Rows) -> list[Event]:
    events: list[Event] = []
    PeriodicVariation(LINES, WINDOW, events).process(*rows)
    return events


@pytest.mark.parametrize("frequency_hz", [0.5, 1.3, 3.7])
def test_a_periodic_variation_is_named_with_its_frequency(frequency_hz: float) -> None:
    """Noise is 13 % of the amplitude, which is the largest of 13 lines."""
    for seed in range(5):
        facts = events_of(windows(seed, 600, varying(seed, 600, frequency_hz, 0.04)))[0].details
        assert facts["variation_hz"] == pytest.approx(frequency_hz, abs=facts["resolution_hz"])
        assert facts["percent"] == pytest.approx(4, rel=0.5)


def test_noise_is_not_reported() -> None:
    """20 runs of ten minutes; at 0.5 %, more than one has a probability of 0.5 %."""
    assert sum(bool(events_of(windows(seed, 6000))) for seed in range(20)) <= 1


@pytest.mark.parametrize("what", ["hum", "drift", "step"])
def test_what_is_no_periodic_variation_is_not_reported(what: str) -> None:
    count = 2400
    number = np.arange(count)[:, np.newaxis] / count
    change = {"hum": 0.05 * np.exp(2j * np.pi * 200 * number), "drift": 0.3 * number, "step": 0.3 * (number > 0.5)}
    for seed in range(5):
        assert not events_of(windows(seed, count, change[what]))


def test_any_division_of_the_windows_and_a_restored_search_report_the_same() -> None:
    rows = windows(3, 600, varying(3, 600, 2.2, 0.04))
    expected = events_of(rows)
    assert len(expected) == 1
    for edges in ([0, 3, 9, 135, 136, 137, 300, 600], list(range(601))):
        events: list[Event] = []
        search = PeriodicVariation(LINES, WINDOW, events)
        for first, last in pairwise(edges):
            snapshot, search = search.snapshot(), PeriodicVariation(LINES, WINDOW, events)
            search.restore(snapshot)
            now = slice(first, last)
            search.process(rows[0][:, now], *(part[now] for part in rows[1:]))
        assert events == expected


def test_a_gap_begins_again() -> None:
    pair, time_s, schedule, sample = windows(3, 250, varying(3, 250, 2.2, 0.04))
    assert not events_of((pair, time_s, schedule, sample + 7 * (np.arange(250) >= 120)))
