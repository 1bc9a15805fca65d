"""Lines: what is on the grid, and what is said about what is not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import GridError, Lines, LivebodeError, UsageError
from tests.support.errors import refused


@given(window=st.integers(8, 5000), rate_hz=st.sampled_from([1000, 2500, 4000, 8000.0]), data=st.data())
def test_every_bin_parses_back_from_its_frequency(window: int, rate_hz: float, data: st.DataObject) -> None:
    bins = data.draw(st.sets(st.integers(1, (window - 1) // 2), min_size=1, max_size=8))
    text = ",".join(repr(k * rate_hz / window) for k in bins)
    lines = Lines.parse(text, rate_hz, window)
    assert lines.bins == tuple(sorted(bins))
    assert np.allclose(lines.frequency_hz, np.array(lines.bins) * rate_hz / window, rtol=1e-15)
    assert np.allclose(lines.z, np.exp(2j * np.pi * lines.frequency_hz / rate_hz))
    assert set(lines.quiet) == set(range(min(bins), max(bins))) - bins


@given(window=st.integers(10, 3000), tenths=st.integers(1, 20_000))
def test_the_windows_that_would_fit_do_fit(window: int, tenths: int) -> None:
    frequency, rate_hz = tenths / 10, 4000
    try:
        assert Lines.parse(str(frequency), rate_hz, window).frequency_hz[0] == pytest.approx(frequency, rel=1e-5)
    except GridError as error:
        if error.code == "grid.above-nyquist":
            assert frequency >= rate_hz / 2 or frequency < rate_hz / window
        else:
            check_proposals(error, frequency)


def check_proposals(error: GridError, frequency: float) -> None:
    assert error.code == "grid.line-off"
    for line in error.nearest_hz:
        assert f"{line:.6g}" in error.remedy
        assert abs(line - frequency) < error.resolution_hz
    for size in error.windows:
        assert str(size) in error.remedy
        assert Lines.parse(str(frequency), error.rate_hz, size).frequency_hz[0] == pytest.approx(frequency)


@pytest.mark.parametrize(
    ("text", "bins"),
    [
        ("20:140:20", (2, 4, 6, 8, 10, 12, 14)),
        ("20:145:20", (2, 4, 6, 8, 10, 12, 14)),
        (" 140 , 20:60:20 ", (2, 4, 6, 14)),
        ("k=3:9:2, 100", (3, 5, 7, 9, 10)),
        ("k=1:4", (1, 2, 3, 4)),
    ],
)
def test_ranges_are_inclusive_and_commas_join(text: str, bins: tuple[int, ...]) -> None:
    assert Lines.parse(text, rate_hz=4000, window=400).bins == bins


@pytest.mark.parametrize(
    ("text", "kind", "code", "facts"),
    [
        ("", UsageError, "unreadable", {"argument": "lines", "value": ""}),
        ("20:140", UsageError, "unreadable", {"value": "20:140"}),
        ("20:140:20:3", UsageError, "unreadable", {"value": "20:140:20:3"}),
        ("20:20:140", UsageError, "out-of-range", {"value": "20:20:140"}),
        ("40:20:5", UsageError, "out-of-range", {"value": "40:20:5"}),
        ("1/0", UsageError, "unreadable", {"value": "1/0"}),
        ("nan", UsageError, "unreadable", {"value": "nan"}),
        ("0", GridError, "above-nyquist", {"frequency_hz": 0.0, "nyquist_hz": 2000.0}),
        ("-20", GridError, "above-nyquist", {"frequency_hz": -20.0}),
        ("2000", GridError, "above-nyquist", {"frequency_hz": 2000.0}),
        ("10:1990:0.00001", UsageError, "too-many", {"argument": "lines", "limit": 100_000}),
        ("20,20", GridError, "line-duplicated", {"bin": 2, "frequency_hz": 20.0}),
        ("25", GridError, "line-off", {"nearest_hz": [20.0, 30.0], "windows": [320, 480]}),
    ],
)
def test_frequencies_that_are_not_a_line_are_refused(
    text: str, kind: type[LivebodeError], code: str, facts: dict
) -> None:
    with refused(kind, code, **facts):
        Lines.parse(text, rate_hz=4000, window=400)


@pytest.mark.parametrize(
    ("text", "meant"), [("20:20:140", "did you mean 20:140:20?"), ("20:5:120", "did you mean 20:120:5?")]
)
def test_exchanged_parts_of_a_range_are_recognised(text: str, meant: str) -> None:
    with pytest.raises(UsageError) as caught:
        Lines.parse(text, rate_hz=4000, window=400)
    assert caught.value.remedy == meant


@pytest.mark.parametrize("window", [0, -4, 2, 2.5, True, "400"])
def test_windows_out_of_range_are_refused(window: object) -> None:
    with refused(GridError, "window-out-of-range", window=window):
        Lines.parse("20", rate_hz=4000, window=window)


@pytest.mark.parametrize("rate_hz", [0, -1, 10**400, float("nan"), float("inf")])
def test_rates_out_of_range_are_refused(rate_hz: float) -> None:
    with refused(UsageError, "out-of-range", argument="rate_hz", value=rate_hz):
        Lines.parse("20", rate_hz=rate_hz, window=400)
