"""A run without a valid response is refused with the reason that its signals have, not with another one."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block, Lines, SignalError
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.preparation import check_some_valid

LINES = Lines.parse("30:130:20", 1000.0, 100)


def refusal(u: np.ndarray, y: np.ndarray) -> SignalError:
    """The error for the responses behind the first periods, which are needed to judge the lines."""
    w = np.resize(multisine(LINES), u.size)
    tracker = Tracker(Settings(lines=LINES, output="y", input="u", excitation="w"))
    late = tracker.process(Block(np.array([w, u, y]), ("w", "u", "y"), 1000.0))[1000:]
    with pytest.raises(SignalError) as caught:
        check_some_valid(len(late), int(late.valid.sum()), tracker)
    assert caught.value.code == "signal.no-valid-response"
    return caught.value


def test_lines_that_are_invalid_by_the_sensors_steps_blame_no_gap() -> None:
    w = np.resize(multisine(LINES), 20_000)
    u = w + 0.01 * np.random.default_rng(0).standard_normal(w.size)
    error = refusal(u, np.round(0.6 * np.roll(w, 3) / np.abs(w).max()))
    assert error.reason == "lines-invalid"
    assert "steps at 30, 50, 70, 90, 110, 130 Hz" in error.message
    assert "gap" not in error.message


def test_samples_that_are_not_finite_in_every_window_are_counted() -> None:
    w = np.resize(multisine(LINES), 20_000)
    y = w.copy()
    y[::50] = np.nan
    error = refusal(w, y)
    assert error.reason == "samples-spoiled"
    assert error.message.endswith("free of the 400 samples that are not finite")
    assert "gap" not in error.message
