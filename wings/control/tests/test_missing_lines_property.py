"""Lines that `tune` says are missing: `design` takes them, and they are where and as close as asked for."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Lines
from livebode_control.tuning.missing_lines import MissingLines
from livebode_design import ExperimentSpec
from livebode_design.grid import grid


@st.composite
def cases(draw: st.DrawFn) -> tuple[Lines, float, float, float]:
    """Lines, and ends and largest step of a span that begins below the Nyquist frequency."""
    rate_hz = draw(st.sampled_from([1000.0, 4000.0, 16000.0, 10_000.0, 44_100.0, 1e6 / 33]))
    window = draw(st.sampled_from([200, 1000, 2047, 2000, 1023 * 2, 1500]))
    bins = draw(st.sets(st.integers(1, (window - 1) // 2), min_size=2, max_size=60))
    lines = Lines.of_bins(sorted(bins), window, rate_hz)
    step = draw(st.floats(0.02, 20)) * lines.resolution_hz
    low = draw(st.floats(0.001, 0.4)) * rate_hz
    return lines, low, low + draw(st.integers(1, 300)) * step, step


@given(cases())
def test_design_takes_the_lines_and_they_cover_the_span(case: tuple[Lines, float, float, float]) -> None:
    lines, low, high, step = case
    missing = MissingLines.of(lines, [(low, high, step)])
    f = grid(ExperimentSpec(lines=missing.lines, window=missing.window), lines.rate_hz).lines.frequency_hz
    assert np.abs(f[:, np.newaxis] - lines.frequency_hz).min(axis=0).max() <= 1e-9 * lines.rate_hz
    end = min(high, lines.rate_hz / 2 - max(step, lines.resolution_hz / 2))
    if low < end:
        assert f[-1] >= end
        first, last = max(0, np.searchsorted(f, low, side="right") - 1), np.searchsorted(f, end)
        assert f[first] <= max(low, step)
        assert np.diff(f[first : last + 1]).max(initial=0) <= step * (1 + 1e-9)


def test_existing_and_missing_lines_are_named_once() -> None:
    lines = Lines.parse("4:100:2, 104:400:8", 4000, 2000)
    missing = MissingLines.of(lines, [(48.0, 64.0, 0.67), (400.0, 500.0, 9.0)])
    assert missing.spans == ("48:64:0.5", "400:504:8")
    assert missing.lines == "4:48:2, 48.5:64:0.5, 66:100:2, 104:504:8"
    assert missing.window is None
