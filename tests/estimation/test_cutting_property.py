"""Any cutting of the samples into Blocks gives the same Responses, bit for bit, and so does a restored Tracker."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Block, Event, Lines, Responses
from livebode.estimation import NonPeriodicTracker, RippleOrder, Settings, Tracker
from livebode.excitation import multisine
from tests.support.responses import assert_same

WINDOW, RATE_HZ, SAMPLES = 60, 1000.0, 700
LINES = Lines((4, 8, 13), WINDOW, RATE_HZ, quiet=(5, 6, 7, 9, 10, 11, 12))
OPTIONS = [
    {},
    {"average": True, "forgetting": 1.0},
    {"hop": 7, "ripple": (RippleOrder(90.0, 0.1),)},
    {"hop": 1},
    {"noise": "quiet", "average": True},
    {"hann": True},
    {"differenced": ("y",), "spikes": ("u", "y"), "average": True},
    {"estimator": "direct"},
    {"dtype": "float32"},
    {"dtype": "float32", "differenced": ("y",), "hann": True},
    {"estimator": "lpm", "average": True, "differenced": ("y",), "hop": 7},
    {"estimator": "welch"},
]


def record(seed: int) -> Block:
    """A noisy plant with a stretch of NaN, a spike and, from sample 300 on, numbers that jump."""
    rng = np.random.default_rng(seed)
    w = np.resize(multisine(LINES), SAMPLES)
    u = w + 0.1 * rng.standard_normal(SAMPLES)
    y = np.convolve(u, [0.5, 0.3, 0.2])[:SAMPLES] + 0.1 * rng.standard_normal(SAMPLES)
    y[205] = np.nan
    u[520] += 40.0
    y[610] = 1e40
    return Block(np.array([w, u, y, np.linspace(0, 1, SAMPLES)]), ("w", "u", "y", "x"), RATE_HZ, start=17)


def cut(block: Block, at: list[int], jump: int) -> list[Block]:
    """The block in pieces, with samples missing before number 300."""
    edges = sorted({0, len(block), 300, *at})
    pieces = [block.cut(a, b) for a, b in pairwise(edges)]
    return [
        Block(
            p.data,
            p.channels,
            p.rate_hz,
            p.start + jump * (p.start >= 317),
            p.origin_s,
            gap=p.start == 317 and not jump,
        )
        for p in pieces
    ]


def new(options: dict) -> Tracker | NonPeriodicTracker:
    names = {"lines": LINES, "output": "y", "input": "u", "excitation": "w", "schedule": "x"}
    if options.get("estimator") == "welch":
        names["lines"] = Lines((1, 3), 20, RATE_HZ)
    made = Settings(**(names | options))
    return Tracker(made) if made.periodic else NonPeriodicTracker(made)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@settings(max_examples=10, deadline=None)
@given(at=st.lists(st.integers(1, SAMPLES - 1), max_size=12), jump=st.sampled_from([0, 23]), seed=st.integers(0, 9))
def test_any_cut_gives_the_same_bits(options: dict, at: list[int], jump: int, seed: int) -> None:
    block = record(seed)
    whole, pieces = new(options), new(options)
    events: tuple[list[Event], list[Event]] = [], []
    expected = Responses.join([whole.process(b, events[0].append) for b in cut(block, [], jump)])
    assert_same(Responses.join([pieces.process(b, events[1].append) for b in cut(block, at, jump)]), expected)
    assert events[0] == events[1]
    assert pieces.counts == whole.counts


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@settings(max_examples=6, deadline=None)
@given(at=st.lists(st.integers(1, SAMPLES - 1), min_size=1, max_size=6), seed=st.integers(0, 9))
def test_a_restored_tracker_continues_with_the_same_bits(options: dict, at: list[int], seed: int) -> None:
    block = record(seed)
    expected = Responses.join([new(options).process(block)])
    tracker, parts = new(options), []
    edges = sorted({0, len(block), *at})
    for a, b in pairwise(edges):
        parts.append(tracker.process(block.cut(a, b)))
        snapshot = tracker.snapshot()
        tracker = new(options)
        tracker.restore(snapshot)
    assert_same(Responses.join(parts), expected)


def test_single_samples_give_the_same_as_one_block() -> None:
    block = record(3)
    tracker = new({})
    parts = [tracker.process(block.cut(i, i + 1)) for i in range(len(block))]
    assert_same(Responses.join(parts), new({}).process(block))
