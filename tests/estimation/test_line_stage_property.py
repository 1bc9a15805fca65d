"""A tracker whose line stage and verdicts are those of the NumPy twins gives the same responses, bit for bit."""

from __future__ import annotations

from itertools import pairwise
from typing import Any
from unittest.mock import patch

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Block, Lines, Loop, Responses
from livebode.estimation import RippleOrder, Settings, Tracker, line_stage
from livebode.estimation.verdicts import Judge
from livebode.excitation import multisine
from tests.twins import lines as line_twin
from tests.twins import repeating as repeating_twin

WINDOW, RATE_HZ, SAMPLES = 60, 1000.0, 500
LINES = Lines((4, 8, 13), WINDOW, RATE_HZ, quiet=(5, 6, 7, 9, 10, 11, 12))

quantities = st.sampled_from(["plant", "plant", "open loop", "closed loop", "sensitivity"])
options = st.fixed_dictionaries(
    {
        "estimator": st.sampled_from(["direct", "joint", "joint", "indirect"]),
        "quantity": quantities,
        "average": st.booleans(),
        "forgetting": st.sampled_from([0.5, 0.8, 1.0]),
        "hop": st.sampled_from([1, 7, 20, 60, 120]),
        "noise": st.sampled_from(["auto", "periods", "quiet"]),
        "schedule": st.sampled_from([None, "x", "x"]),
        "loop": st.sampled_from([Loop(), Loop(feedback=0.3), Loop(feedback=0.3, input_logged="before")]),
        "hann": st.booleans(),
        "differenced": st.sampled_from([(), ("y",)]),
        "ripple": st.booleans(),
    }
)
faults = st.lists(
    st.tuples(st.integers(0, SAMPLES - 1), st.sampled_from([np.nan, np.inf, -np.inf, 1e40, 0.0])), max_size=4
)


def possible(drawn: dict[str, Any]) -> Settings:
    """The settings, without what does not go with the rest."""
    found = {"lines": LINES, "output": "y", "input": "u", "excitation": "w"} | drawn
    if (found["quantity"] != "plant" and found["estimator"] == "direct") or found["estimator"] == "indirect":
        found["loop"] = Loop(feedback=0.3)
    if found["hann"] and found["noise"] == "quiet":
        found["noise"] = "periods"
    found["ripple"] = (RippleOrder(90.0, 0.1),) if found["ripple"] and found["schedule"] else ()
    return Settings(**found)


def blocks(seed: int, faults: list[tuple[int, float]], edges: list[int], missing: int) -> list[Block]:
    """A loop with noise whose excitation begins late, in pieces; some samples are missing before the last one."""
    rng = np.random.default_rng(seed)
    w = np.resize(multisine(LINES), SAMPLES)
    w[:70] = 0.0
    u = w + 0.1 * rng.standard_normal(SAMPLES)
    y = np.convolve(u, [0.5, 0.3, 0.2])[:SAMPLES] + 0.1 * rng.standard_normal(SAMPLES)
    x = np.concatenate([np.zeros(200), np.linspace(0, 1, SAMPLES - 200)])
    for at, value in faults:
        (u if at % 2 else y)[at] = value
    cuts = sorted({0, *edges, SAMPLES})
    data = np.array([w, u, y, x])
    return [
        Block(data[:, a:b], ("w", "u", "y", "x"), RATE_HZ, start=a + missing * (b == SAMPLES))
        for a, b in pairwise(cuts)
    ]


def responses(made: Settings, pieces: list[Block]) -> Responses:
    tracker = Tracker(made)
    return Responses.join([tracker.process(block) for block in pieces])


@settings(max_examples=50, deadline=None)
@given(
    options,
    st.integers(0, 99),
    faults,
    st.lists(st.integers(1, SAMPLES - 1), max_size=4),
    st.sampled_from([0, 0, 5, 60]),
)
def test_a_tracker_gives_the_bits_of_its_twins(drawn, seed, faults, edges, missing):
    made, pieces = possible(drawn), blocks(seed, faults, edges, missing)
    found = responses(made, pieces)
    process = patch.object(line_stage, "process_lines", line_twin.process_lines)
    with process, patch.object(Judge, "process", repeating_twin.process):
        expected = responses(made, pieces)
    assert found.equals(expected)
