"""A drift of the machine within a record is found, and the bound of the mean covers it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from livebode.core import Lines, Responses
from livebode.fitting import DriftTest, mean_response
from livebode.fitting.time_course import FALSE_ALARM

LINES = Lines.parse("20:140:10", 4000, 400)
NOISE = 0.02  # of the response, in a window
Shape = Callable[[np.ndarray], np.ndarray]


def even(x: np.ndarray) -> np.ndarray:
    return x


def settling(x: np.ndarray) -> np.ndarray:
    """As of a temperature: a time constant of a third of the record."""
    return np.asarray((1 - np.exp(-3 * x)) / (1 - np.exp(-3)))


def record(
    rng: np.random.Generator, windows: int, change: float, shape: Shape = even
) -> tuple[Responses, Callable[[np.ndarray], np.ndarray]]:
    """Responses of windows one after the other, and the true response at a share of the record, (moments, lines)."""
    n = len(LINES)
    beginning = rng.uniform(0.2, 3, n) * np.exp(2j * np.pi * rng.uniform(size=n))
    further = change * beginning * np.exp(2j * np.pi * rng.uniform(size=n))

    def truth(at: np.ndarray) -> np.ndarray:
        return np.asarray(beginning + np.outer(shape(at), further))

    noise = rng.standard_normal((2, windows, n)) * NOISE * np.abs(beginning) / np.sqrt(2)
    number, ones = np.arange(windows), np.ones((windows, n))
    responses = Responses(
        lines=LINES,
        value=truth((number + 0.5) / windows) + noise[0] + 1j * noise[1],
        sigma=ones * NOISE,
        dof=np.full(windows, 5.0),
        coherence=ones * 0.9,
        valid=ones > 0,
        first=number * 400,
        sample=number * 400 + 399,
        time_s=(number + 0.5) * 0.1,
        schedule=np.full(windows, np.nan),
        quantity="plant",
        unit="",
    )
    return responses, truth


@pytest.mark.parametrize("windows", [10, 50])
def test_noise_alone_is_rarely_taken_for_drift(windows: int) -> None:
    """At 0.5 %, of 400 records more than 8 are reported with a probability of 0.02 %."""
    rng = np.random.default_rng(windows)
    alarms = 0
    for _ in range(400):
        test = DriftTest(LINES)
        test.add(record(rng, windows, 0.0)[0])
        alarms += test.result().significant
    assert FALSE_ALARM == 0.005
    assert alarms <= 8


def step(x: np.ndarray) -> np.ndarray:
    return np.asarray(x > 0.7, dtype=np.float64)


def periodic(x: np.ndarray) -> np.ndarray:
    """Neither a whole number of times in the record nor of windows."""
    return np.asarray(np.sin(2 * np.pi * 4.3 * x + 1) / 2)


@pytest.mark.parametrize("shape", [even, settling, step, periodic])
@pytest.mark.parametrize(("windows", "change"), [(20, 0.05), (20, 0.2), (100, 0.02), (100, 0.1)])
def test_the_bound_of_the_mean_covers_a_drifting_response(windows: int, change: float, shape: Shape) -> None:
    """1 sigma covers at least 60 % of the moments, 2 sigma 95 %: 650 records and lines, 20 moments each."""
    rng = np.random.default_rng(5)
    covered = []
    for _ in range(50):
        responses, truth = record(rng, windows, change, shape)
        mean = mean_response(responses)
        ratio = np.abs(mean.value - truth(rng.uniform(size=20))) / mean.sigma
        covered.append([np.mean(ratio < 1), np.mean(ratio < 2)])
    one, two = np.mean(covered, axis=0)
    assert one >= 0.6
    assert two >= 0.95


def test_the_change_from_the_beginning_to_the_end_is_measured() -> None:
    """Of 13 lines, at most one is farther from the truth than three of its standard deviations (0.01 % each)."""
    responses, truth = record(np.random.default_rng(3), 50, 0.05)
    test = DriftTest(LINES)
    test.add(responses)
    found = test.result()
    change = truth(np.array([1.0]))[0] - truth(np.array([0.0]))[0]
    assert found.significant
    assert np.sum(np.abs(found.change - change) > 3 * found.sigma) <= 1


def test_overlapping_windows_and_pieces_change_nothing() -> None:
    """Of windows that overlap those one after the other are used; where the responses are cut does not matter."""
    responses, _ = record(np.random.default_rng(4), 70, 0.02)
    whole, cut = DriftTest(LINES), DriftTest(LINES)
    whole.add(responses)
    for at in range(0, 70, 9):
        cut.add(responses[at : at + 9])
    assert np.array_equal(whole.result().change, cut.result().change)
    doubled = Responses.join([part for at in range(70) for part in (responses[at : at + 1],) * 2])
    again = DriftTest(LINES)
    again.add(doubled)
    assert np.array_equal(again.result().change, whole.result().change)


@pytest.mark.parametrize(("way_m", "found"), [(0.3, False), (1e-5, True)])
def test_a_response_that_may_depend_on_the_position_is_no_drift(way_m: float, found: bool) -> None:
    """An axis at 0.8 m moves slowly to one side, and the response with it; at standstill only its encoder moves."""
    responses, _ = record(np.random.default_rng(6), 60, 0.1)
    test = DriftTest(LINES)
    test.add(Responses(**{**vars(responses), "schedule": 0.8 + way_m * np.linspace(0, 1, 60)}))
    assert test.result().significant == found


def test_windows_in_parts_give_the_bits_of_windows_one_by_one() -> None:
    rng = np.random.default_rng(3)
    found, _ = record(rng, 700, 0.1)
    valid = rng.random(found.value.shape) < 0.9
    found = replace(found, valid=valid, first=np.arange(700) * 130, sample=np.arange(700) * 130 + 399)
    one_by_one, in_parts = DriftTest(LINES), DriftTest(LINES)
    for at in range(700):
        one_by_one.add(found[at : at + 1])
    for at in range(0, 700, 90):
        in_parts.add(found[at : at + 90])
    assert in_parts.snapshot() == one_by_one.snapshot()
