"""Any cutting of the samples into Blocks gives the same windows, and the unit of an output changes no mode."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Block
from livebode_modes import ModeTracker, OutputOnlySettings, WindowModes
from tests.support.ringing import two_modes

SAMPLES = 4000
OF = OutputOnlySettings(("a", "b"), 500.0, (2.0, 60.0), 3, 50, 12)
Y = two_modes(11, SAMPLES, 2)
Y[0, 1500] = np.nan


def found(y: np.ndarray, edges: list[int]) -> list[WindowModes]:
    block, tracker = Block(y, OF.outputs, OF.rate_hz), ModeTracker(OF)
    return [window for a, b in pairwise(edges) for window in tracker.process(block.cut(a, b))]


def numbers(windows: list[WindowModes]) -> np.ndarray:
    rows = [
        (w.sample, w.time_s, mode.frequency_hz, mode.damping, *mode.covariance.ravel())
        for w in windows
        for mode in w.modes
    ]
    return np.array(rows)


WHOLE = found(Y, [0, SAMPLES])


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.sets(st.integers(1, SAMPLES - 1), max_size=12))
def test_any_cutting_gives_the_same_windows(at: set[int]) -> None:
    np.testing.assert_allclose(numbers(found(Y, sorted({0, SAMPLES, *at}))), numbers(WHOLE), rtol=1e-9)


@settings(max_examples=10, deadline=None, derandomize=True)
@given(st.floats(1e-6, 1e6), st.floats(-1e3, 1e3))
def test_unit_and_offset_of_the_outputs_change_no_mode(factor: float, offset: float) -> None:
    y = factor * (Y + offset)
    np.testing.assert_allclose(numbers(found(y, [0, SAMPLES])), numbers(WHOLE), rtol=1e-5, atol=1e-12)
