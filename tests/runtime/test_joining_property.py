"""Axes of a process that are tracked together have the bits that each has alone, whichever are joined."""

from __future__ import annotations

from functools import cache
from itertools import cycle
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.configuration import Axis
from livebode.core import NOT_WHOLE, SPIKE, Channel, Event, Responses, Spectra, SpectraLayout
from livebode.estimation import SpectraTracker
from livebode.preparation import live_follower
from livebode.runtime.joining import WaitingSpectra, track_together
from livebode.runtime.single_response import ROWS_MAX

RATE_HZ, WINDOW, HOP, LINES = 4000.0, 100, 25, (2, 4, 6, 8, 10)
SIGNALS = Channel("y", "rad/s"), Channel("other"), Channel("u", "N m"), Channel("w", "N m")
ROWS = 24
TRACKED: list[dict[str, Any]] = [
    {},
    {},
    {},
    {"tracking": {"average": True, "forgetting": 0.5}},
    {"tracking": {"average": True, "forgetting": 0.5}},
    {"signals": {"output": "y", "input": "u", "excitation": "w", "schedule": "x"}},
    {"signals": {"output": "y", "input": "u", "excitation": "w", "schedule": "x"}},
    {"signals": {"output": "y", "input": "u"}, "tracking": {"estimator": "direct"}},
]
"""Axes 0 to 2, and 5 and 6 are alike; 3 and 4, whose averages are tested for changes, and 7, whose input is no
excitation, are tracked alone."""
UNUSUAL = "not whole", "spike", "not finite", "implausible", "gap"


def tracker(number: int) -> SpectraTracker:
    signals = {"output": "y", "input": "u", "excitation": "w"}
    about = {"source": {"url": "udp://127.0.0.1:5000"}, "signals": signals} | TRACKED[number]
    found = live_follower(Axis.of(about, "a test"), RATE_HZ, layout())
    assert isinstance(found, SpectraTracker)
    return found


@cache
def layout() -> SpectraLayout:
    return SpectraLayout(SIGNALS, (Channel("x", "m"),), WINDOW, HOP, LINES)


def spectra(number: int, unusual: dict[int, str]) -> Spectra:
    """All spectra of an axis."""
    rng = np.random.default_rng(number)
    truth = np.array([0.3 - 0.2j, 1.0, 0.7 + 0.1j, 1.0])[:, np.newaxis, np.newaxis]
    noise = rng.standard_normal((4, ROWS, len(LINES), 2)).view(np.complex128)[..., 0]
    sums, state = 50 * truth * (1 + 0.01 * noise), np.zeros(ROWS, np.uint32)
    for row, kind in unusual.items():
        state[row] = {"not whole": NOT_WHOLE, "spike": SPIKE}.get(kind, 0)
        sums[2, row, 1] = np.nan if kind == "not finite" else sums[2, row, 1]
        sums[:, row] *= 1e12 if kind == "implausible" else 1
    channels = (*SIGNALS, Channel("x", "m"))
    data = rng.standard_normal((len(channels), ROWS))
    return Spectra(data, channels, RATE_HZ, layout=layout(), sums=sums, state=state, place=HOP)


def blocks(every: Spectra, sizes: list[int], unusual: dict[int, str]) -> list[Spectra]:
    """All spectra in Blocks; a `gap` begins another one after a spectrum that is lost."""
    found, begin, size = [], 0, cycle(sizes)
    while begin < ROWS:
        end = min(begin + next(size), ROWS)
        end = next((row for row in range(begin + 1, end) if unusual.get(row) == "gap"), end)
        first = begin + (unusual.get(begin) == "gap")
        if first < end:
            found.append(every.cut(first, end))
        begin = end
    return found


def joined(
    trackers: list[SpectraTracker], each: list[list[Spectra]]
) -> tuple[list[list[Responses]], list[list[Event]]]:
    """The next Block of each axis, as long as one has any."""
    found: list[list[Responses]] = [[] for _ in trackers]
    events: list[list[Event]] = [[] for _ in trackers]
    for turn in range(max(map(len, each))):
        due = {i: of[turn] for i, of in enumerate(each) if turn < len(of)}
        usual = {i: trackers[i].usual(block) for i, block in due.items() if len(block) <= ROWS_MAX}
        waiting = {i: WaitingSpectra(trackers[i], one) for i, one in usual.items() if one is not None}
        together = dict(zip(waiting, track_together([*waiting.values()])))
        for i, block in due.items():
            responses = together.get(i)
            found[i] += [] if responses is None else [responses]
            taken = 0 if responses is None else len(responses)
            if taken < len(block):
                found[i].append(trackers[i].process(block.cut(taken, len(block)), events[i].append))
    return found, events


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(0, len(TRACKED) - 1), min_size=2, max_size=6),
    st.lists(st.dictionaries(st.integers(3, ROWS - 1), st.sampled_from(UNUSUAL), max_size=3), min_size=6, max_size=6),
    st.lists(st.lists(st.integers(1, ROWS_MAX + 2), min_size=2, max_size=ROWS), min_size=6, max_size=6),
)
def test_bits_states_and_events_of_an_axis_are_those_of_it_alone(axes, unusual, sizes):
    every = [spectra(i, unusual[i]) for i in range(len(axes))]
    each = [blocks(one, of, bad) for one, of, bad in zip(every, sizes, unusual)]
    together = [tracker(number) for number in axes]
    found, events = joined(together, each)
    for i, number in enumerate(axes):
        alone, of_alone = tracker(number), []
        whole = blocks(every[i], [ROWS], unusual[i])  # as many spectra at once as follow each other
        expected = [alone.process(block, of_alone.append) for block in whole]
        assert Responses.join(found[i]).equals(Responses.join(expected))
        assert events[i] == of_alone
        assert together[i].snapshot() == alone.snapshot()


def test_axes_that_are_alike_are_one_call(monkeypatch):
    calls = []
    process_each = SpectraTracker.process_each

    def counted(trackers: list[SpectraTracker], newest: Any) -> Any:
        calls.append(len(trackers))
        return process_each(trackers, newest)

    monkeypatch.setattr(SpectraTracker, "process_each", staticmethod(counted))
    trackers = [tracker(number) for number in range(len(TRACKED))]
    every = [spectra(i, {}) for i in range(len(trackers))]
    first = [own.process(one.cut(0, 2)) for own, one in zip(trackers, every)]
    waiting = [own.usual(one.cut(2, 4)) for own, one in zip(trackers, every)]
    assert [i for i, one in enumerate(waiting) if one is None] == [3, 4, 7]
    found = track_together([WaitingSpectra(own, one) for own, one in zip(trackers, waiting) if one is not None])
    assert sorted(calls) == [2, 2, 3, 3]
    assert [len(one) for one in found if one is not None] == [2] * 5
    assert all(len(one) == 2 for one in first)
