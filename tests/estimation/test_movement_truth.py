"""A machine moves where its schedule does more than jitter, whatever its offset and its unit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.analysis import averaged
from livebode.core import Block, Channel, Event, Responses
from livebode.estimation import Movement, Settings, Tracker
from livebode.excitation import multisine, odd_lines
from livebode.records import RunRecord
from tests.support.found import with_events
from tests.support.reports import write_run

RATE_HZ, N, PERIODS = 4000.0, 800, 60
LINES = odd_lines(20, 140, RATE_HZ, N, seed=1)
W = np.tile(multisine(LINES, phases="random", seed=2), PERIODS)
T = np.arange(W.size) / RATE_HZ
RNG = np.random.default_rng(3)
NOISE = RNG.standard_normal(W.size)
SLOW_NOISE = np.convolve(NOISE, np.ones(40) / np.sqrt(40), "same")

STILL = {
    "sensor noise": 1e-6 * NOISE,
    "noise behind a low-pass": 1e-6 * SLOW_NOISE,
    "vibration by the excitation, with noise": 1e-4 * W + 1e-6 * NOISE,
    "an encoder that flickers by a count": 1e-6 * np.round(0.4 * SLOW_NOISE),
    "a drift of a count in 20 periods": 1e-6 * np.round(T * RATE_HZ / N / 20),
    "a drift below the noise": 1e-6 * NOISE + 1e-7 * T,
}
MOVING = {
    "strokes": 0.3 * np.sin(2 * np.pi * T / 3),
    "fast strokes": 0.3 * np.sin(2 * np.pi * T / 1.1),
    "a slow feed": 1e-3 * T + 1e-6 * NOISE,
    "strokes by a coarse encoder": 1e-3 * np.round(100 * np.sin(2 * np.pi * T / 3)),
}
PLACES = [(0.0, 1.0), (50.0, 1.0), (-5e4, 1e3)]  # offset and unit


def tracked(x: np.ndarray, hop: int = 40) -> tuple[Tracker, Responses, list[Event]]:
    settings = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="x", hop=hop)
    tracker = Tracker(settings)
    y = W + 0.01 * RNG.standard_normal(W.size)
    block = Block(np.array([W, W, y, x]), (Channel("w"), Channel("u"), Channel("y"), Channel("x")), RATE_HZ)
    return tracker, *with_events(tracker.process, block)


@pytest.mark.parametrize(("offset", "unit"), PLACES)
@pytest.mark.parametrize("name", STILL)
def test_an_axis_that_only_jitters_does_not_move(name: str, offset: float, unit: float) -> None:
    _, responses, events = tracked(offset + unit * STILL[name])
    assert events == []
    assert np.isfinite(responses.distortion[-1]).all()  # judged at standstill


@pytest.mark.parametrize(("offset", "unit"), PLACES)
@pytest.mark.parametrize("name", MOVING)
def test_an_axis_that_moves_is_seen_wherever_it_is(name: str, offset: float, unit: float) -> None:
    tracker, responses, events = tracked(offset + unit * MOVING[name])
    assert [event.kind for event in events] == ["noise-from-detection-lines"]
    assert tracker.found()["judged"]["noise_from_detection_lines"] > 0.8 * len(responses)
    assert not np.any(responses.distortion[-1] > 0.01)  # a linear machine, judged in motion where that is steady


@pytest.mark.parametrize("hop", [800, 200, 40])
def test_a_run_records_whether_the_axis_moved(hop: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    for i, (x, moved) in enumerate([(STILL["sensor noise"], False), (50 + MOVING["strokes"], True)]):
        tracker, responses, _ = tracked(x, hop)
        found = tracker.found() | {"quantity": responses.quantity, "unit": responses.unit}
        run = write_run(tmp_path_factory.mktemp(f"{i}") / "run", responses, found=found)
        assert averaged(RunRecord.open(run)).moved == moved


@settings(max_examples=30, deadline=None)
@given(places=st.sampled_from([1, 3, 20, 50]), at=st.lists(st.integers(0, 400), max_size=6), seed=st.integers(0, 9))
def test_any_cut_gives_the_same_and_so_does_a_restored_one(places: int, at: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    moves = np.convolve(rng.random(400) < 0.02, np.hanning(30), "same")
    x = np.cumsum(moves) + 0.01 * rng.standard_normal(400)
    whole = Movement(places).process(0, x)
    assert whole.any()
    found, movement = [], Movement(places)
    for start, stop in pairwise(sorted({0, 400, *at})):
        again = Movement(places)
        again.restore(movement.snapshot())
        movement = again
        found.append(movement.process(start % places, x[start:stop]))
    np.testing.assert_array_equal(np.concatenate(found), whole)
