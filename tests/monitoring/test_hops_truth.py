"""Tables judge a moving machine alike at every hop, and wherever in the excitation's period a recording begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import pytest

from livebode.core import BaselineError, Block, Event
from livebode.estimation import Settings, Tracker
from livebode.monitoring import Baseline, Monitor, NonOverlappingWindows, learn_table, places, signals_of
from livebode.simulation import Fault, SimulatedAxis, Strokes, TensionLoss
from tests.support.axes import LINES
from tests.support.errors import refused
from tests.support.monitored import HIGH_M, LOW_M, SPEED_M_PER_S, axis

SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", noise="quiet", hop=20)
LEARNED_S, JUDGED_S = 120.0, 24.0


@cache
def recorded(seed: int, seconds: float, *faults: Fault) -> Block:
    """The same stroke there and back again and again."""
    motion = Strokes(start_m=LOW_M, end_m=HIGH_M, speed_m_per_s=SPEED_M_PER_S)
    return SimulatedAxis(axis(motion, seed, seconds=seconds, run_in_s=5, faults=faults)).run()[0]


@cache
def baseline(hop: int) -> Baseline:
    settings, at = replace(SETTINGS, hop=hop), places(LINES.window, hop)
    responses = Tracker(settings).process(recorded(1, LEARNED_S))
    rows = [NonOverlappingWindows(max(LINES.window, hop), place).of_responses(responses) for place in at]
    table = learn_table("lines", [f"{f:g} Hz" for f in LINES.frequency_hz], rows, len(at))
    return Baseline(LINES, hop, signals_of(settings), "joint", "plant", (table,), None)


def events_of(learned: Baseline, block: Block, hop: int) -> Sequence[Event]:
    settings = replace(SETTINGS, hop=hop)
    monitor = Monitor(learned, settings)
    events = monitor.process_responses(Tracker(settings).process(block)) + monitor.finish()
    assert monitor.summary()["judged_s"] > 0.6 * JUDGED_S
    return [event for event in events if event.kind != "baseline-unknown"]


@pytest.mark.parametrize("learned", [20, 80])
def test_no_hop_and_no_beginning_makes_a_healthy_machine_another(learned: int) -> None:
    """One false alarm in 30 days is asked for and six minutes are judged: with 1e-4 is there one by chance.

    Learned at the place of one hop alone, every other place raised one within 20 s.
    """
    for seed in (2, 3):
        block = recorded(seed, JUDGED_S)
        for hop, begin in ((20, 0), (40, 0), (100, 0), (400, 0), (89, 0), (20, 50), (100, 80), (400, 350)):
            later = Block(block.data[:, begin:], block.channels, block.rate_hz)
            assert events_of(baseline(learned), later, hop) == [], (seed, hop, begin)


def test_the_same_change_is_detected_at_every_hop() -> None:
    """Loss of 5 % at 10 s, at the latest two strokes later; the windows that are judged are the same ones."""
    block = recorded(4, JUDGED_S, TensionLoss(start_s=10.0, loss=0.05))
    first, *others = (events_of(baseline(20), block, hop) for hop in (20, 50, 100, 200, 400))
    assert [event.kind for event in first] == ["change"]
    assert 10.0 < first[0].time_s < 17.0
    assert abs(first[0].details["since_s"] - 10.0) < 1.0
    messages = [(event.sample, event.message) for event in first]
    assert [[(event.sample, event.message) for event in events] for events in others] == [messages] * 4


@pytest.mark.parametrize(("learned", "hop"), [(20, 800), (400, 89), (100, 89), (800, 1200)])
def test_windows_that_the_baseline_does_not_know_are_refused(learned: int, hop: int) -> None:
    with refused(BaselineError, "settings-differ", setting="hop", learned=learned, value=hop):
        Monitor(replace(baseline(20), hop=learned), replace(SETTINGS, hop=hop))


@pytest.mark.parametrize(("learned", "hop"), [(800, 400), (800, 20), (200, 20), (89, 89), (20, 89)])
def test_windows_that_the_baseline_knows_are_taken(learned: int, hop: int) -> None:
    assert Monitor(replace(baseline(20), hop=learned), replace(SETTINGS, hop=hop)).tables == ["lines"]
