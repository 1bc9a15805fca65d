"""Raw signals: nothing is retained without a page, spikes and gaps are visible, the spectrum is that of SciPy."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from playwright.sync_api import Browser

from livebode.core import Block, Channel, Lines, Spectra, SpectraLayout, UsageError
from livebode.dashboard import Hub, signal_tap
from livebode.dashboard.queries import signals_asked
from livebode.dashboard.signal_answer import POINTS_MAX, amplitude_spectrum, answer, columns_of, extremes, remark_of
from livebode.dashboard.signal_tap import WATCHED_S, SignalTap, span_samples
from livebode.dashboard.signals import recorded_answer
from livebode.runtime import Channels, TrackerResults
from tests.support.browser import Tab
from tests.support.dashboards import BAD, LINES, RATE_HZ, Watched, data
from tests.support.errors import refused

CHANNELS = (Channel("u", "N m"), Channel("y", "rad/s"))


def block_of(values: np.ndarray, start: int = 0) -> Block:
    return Block(values, tuple(c.name for c in CHANNELS), 1000.0, start=start)


def decoded(data: bytes, names: tuple[str, ...]) -> dict[str, Any]:
    """An answer as signal_answer.py describes it, read by NumPy."""
    (size,) = struct.unpack_from("<I", data)
    head, at = json.loads(data[4 : 4 + size]), 4 + size
    assert at % 4 == 0
    for channel in head.get("channels", []):
        for name in names:
            channel[name] = np.frombuffer(data, "<u4" if name == "at" else "<f4", channel["points"], at)
            at += 4 * channel["points"]
    assert at == len(data)
    return dict(head)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 900), st.sampled_from([0, 0, 0, 7])), min_size=1, max_size=20))
def test_the_tap_has_the_newest_second_however_the_samples_arrive(pieces: list[tuple[int, int]]) -> None:
    """Each piece has a size, and a number of samples that are lost before it."""
    tap, rng = SignalTap(), np.random.default_rng(0)
    tap.begin(CHANNELS, window=400)
    tap.watch()
    truth, at = np.full((2, sum(n + gap for n, gap in pieces)), np.nan), 0
    for n, gap in pieces:
        at += gap
        truth[:, at : at + n] = rng.normal(size=(2, n))
        tap.add(block_of(truth[:, at : at + n], at), 0.0)
        at += n
    found = tap.newest()
    assert found is not None
    start = max(pieces[0][1], at - 1000)
    assert (found.start, found.stop, found.channels) == (start, at, CHANNELS)
    assert np.array_equal(found.data, truth[:, start:], equal_nan=True)


def test_nothing_is_retained_unless_somebody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    hub, now = Hub("axis"), [0.0]
    monkeypatch.setattr(signal_tap.time, "monotonic", lambda: now[0])
    hub(Channels(CHANNELS, 1000.0))

    def publish(start: int) -> Block | None:
        block = block_of(np.ones((2, 10)), start)
        hub(TrackerResults(block, block.stop, None))
        return hub.signals.newest()

    assert publish(0) is None
    hub.signals.watch()
    newest = publish(10)
    assert newest is not None
    assert (newest.start, len(newest)) == (10, 10)
    restarted = publish(0)
    assert restarted is not None
    assert (restarted.start, len(restarted)) == (0, 10), "a source that begins again has no samples in common"
    now[0] += WATCHED_S + 0.1
    assert publish(20) is None, "after the last request the samples are released"


def test_memory_is_bounded_at_any_rate_and_window() -> None:
    for rate_hz, window in ((1e6, 400), (100.0, 1 << 24)):
        assert span_samples(rate_hz, window, 40) * 40 <= signal_tap.VALUES_MAX


def test_a_source_of_spectra_is_recognised() -> None:
    layout = SpectraLayout(CHANNELS, (), window=400, hop=20, lines=(2, 4))
    tap = SignalTap()
    tap.watch()
    sums, state = np.zeros((2, 3, len(layout.bins)), complex), np.zeros(3, np.uint32)
    tap.add(Spectra(np.zeros((2, 3)), CHANNELS, 4000.0, layout=layout, sums=sums, state=state, place=0), 0.0)
    assert tap.spectra
    assert tap.newest() is None


@pytest.mark.parametrize(("samples", "window"), [(1000, 100), (1001, 143), (3850, 350)])
def test_amplitudes_are_those_of_scipy(samples: int, window: int) -> None:
    x = np.random.default_rng(1).normal(3.0, 1.0, samples)
    found = amplitude_spectrum(x, 1000.0, window)
    assert found is not None
    assert found.samples == samples
    hz, power = scipy.signal.periodogram(x, 1000.0, "hann", detrend="constant", scaling="spectrum")
    peak = np.sqrt(2 * power)
    peak[0] /= np.sqrt(2)
    if samples % 2 == 0:
        peak[-1] /= np.sqrt(2)
    assert np.allclose(found.frequency_hz, hz)
    assert np.allclose(found.amplitude, peak, rtol=1e-12, atol=1e-14)


def test_each_line_has_its_amplitude_beside_others_motion_and_a_gap() -> None:
    """Neighbouring lines over two windows; the newest piece without a gap that has two windows is used."""
    lines = Lines((3, 4, 20), 400, 4000.0, quiet=(10,))
    t = np.arange(1050) / 4000
    sizes = {30.0: 0.5, 40.0: 0.02, 200.0: 1e-4}
    x = 7.0 + sum(a * np.sin(2 * np.pi * f * t + f) for f, a in sizes.items())
    x[100] = x[1040] = np.nan
    one = decoded(answer(Block(np.array([x]), (CHANNELS[0],), 4000.0), lines, "log"), ("hz", "high", "low"))[
        "channels"
    ][0]
    assert one["lines"] == pytest.approx(list(sizes.values()), rel=1e-9)
    assert one["detection"] == pytest.approx([0.0], abs=1e-12)
    assert (one["seconds"], one["resolution_hz"], one["missing"]) == (0.2, 7.5, 2)
    assert amplitude_spectrum(x[101:900], 4000.0, 400) is None


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 30_000), st.integers(0, 2**32 - 1))
def test_few_points_have_every_spike_and_every_gap(samples: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = rng.normal(size=samples)
    spikes, gaps = rng.integers(0, samples, 2), rng.integers(0, samples, 2)
    x[spikes] = (50.0, -50.0)
    x[gaps] = np.nan
    at = extremes(x)
    assert len(at) <= POINTS_MAX
    assert np.all(np.diff(at) > 0)
    assert np.isnan(x[at]).any()
    if np.isfinite(x).any():
        assert (np.nanmax(x[at]), np.nanmin(x[at])) == (np.nanmax(x), np.nanmin(x))
    if samples > POINTS_MAX:
        width = -(-samples // 500)
        assert set(gaps // width) <= set(at[np.isnan(x[at])] // width), "each column with a gap shows one"


@pytest.mark.parametrize("logarithmic", [False, True])
def test_columns_of_a_spectrum_have_its_peaks(logarithmic: bool) -> None:
    amplitude = np.random.default_rng(0).uniform(1, 2, 20_001)
    amplitude[[1, 77, 19_999]] = 10.0
    at, low = columns_of(amplitude, logarithmic=logarithmic)
    assert len(at) <= POINTS_MAX
    assert np.all(np.diff(at) > 0)
    assert {1, 77, 19_999} <= set(at.tolist())
    assert np.all(low <= amplitude[at])
    assert low.min() == amplitude[1:].min()


def test_what_is_conspicuous_is_said_and_nothing_else() -> None:
    t = np.arange(4000) / 4000
    sine = np.sin(2 * np.pi * 3 * t)
    found = remark_of(np.clip(sine, -2, 0.8))
    assert (found.limit, found.limited) == (0.8, int((sine >= 0.8).sum()))
    for calm in (sine, np.round(sine, 4), np.round(sine, 1), 1e-3 * np.random.default_rng(0).normal(size=4000)):
        assert remark_of(calm) == remark_of(np.array([0.0, 1.0]))
    assert remark_of(np.full(9, 2.5)).constant
    assert remark_of(np.array([1.0, np.nan, np.inf])).missing == 2
    assert remark_of(np.full(3, np.nan)).missing == 3


def test_a_query_for_signals_is_checked() -> None:
    with refused(UsageError, "not-one-of", argument="picture"):
        signals_asked({"picture": "polar"}, 1)
    with refused(UsageError, "unreadable"):
        signals_asked({"at": "nan"}, 1)


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    """A live run that records its samples, and a finished one that did not."""
    folder = tmp_path_factory.mktemp("signals")
    found = Watched(folder / "run", samples=True)
    with Watched(folder / "whole") as other:
        other.go(2000)
    found.dashboard.view(other.directory)
    with found:
        found.go(2000)
        yield found


def shown(tab: Tab, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """What the chart of a channel shows."""
    of = f"signals.charts.find((c) => c.plot.ariaLabel.startsWith('{channel}')).made.data"
    return tab.numbers(f"{of}[0]"), tab.numbers(f"{of}[1]")


def test_the_page_shows_the_signals_of_the_second_that_it_names(browser: Browser, watched: Watched) -> None:
    _, u, y, _ = data()
    with Tab(browser, f"{watched.url}#tab=signals") as tab:
        words = tab.page.locator("#signals-words")
        tab.until("signals.answer?.why_not === 'collecting'")
        assert words.inner_text() == "Waiting for samples."
        watched.go(4000)
        tab.until("signals.answer.to_s === 1")
        assert words.inner_text() == "0.50 s to 1.00 s, 2000 samples at 4000 Hz"
        watched.go(8000)
        tab.until("signals.answer.to_s === 2")
        x, values = shown(tab, "y")
        number = np.round(x * RATE_HZ).astype(int)
        known = np.isfinite(values)
        assert (number[0], len(x)) <= (4003, POINTS_MAX)
        assert np.allclose(values[known], y[number[known]], rtol=1e-6, atol=1e-9)
        assert (values[known].max(), values[known].min()) == pytest.approx(
            (np.nanmax(y[4000:8000]), np.nanmin(y[4000:8000]))
        )
        assert number[~known].tolist() == [BAD]
        assert "1 sample missing or not a number" in tab.page.locator(".signal[data-name=y]").inner_text()
        assert tab.js("signals.charts.map((c) => c.made.axes[1].label())") == ["rad/s", "N m", "N m", "m"]

        # Newest samples contain the moment of a pause: they remain. Another moment comes from the record.
        tab.until("timeline.span.last_s > 1.9")
        tab.js("timeline.go(1.9)")
        tab.page.wait_for_timeout(450)
        assert tab.js("[signals.answer.from_s, signals.answer.to_s]") == [1, 2]
        tab.js("timeline.go(1)")
        tab.until("signals.answer.from_s === 0.5")
        x, values = shown(tab, "u")
        assert np.allclose(values, u[np.round(x * RATE_HZ).astype(int)], rtol=1e-6, atol=1e-9)
        tab.page.keyboard.press("q")
        tab.until(
            "signals.answer.channels[0].hz && signals.charts[0].spectrum && signals.charts[0].made.data[0].length"
        )
        assert tab.js("[location.hash.includes('signals=spectrum'), location.hash.includes('tab=signals')]") == [
            True,
            True,
        ]
        hz, level = shown(tab, "u")
        _, power = scipy.signal.periodogram(u[2000:6000], RATE_HZ, "hann", detrend="constant", scaling="spectrum")
        peak = np.sqrt(2 * power)[np.round(hz).astype(int)]
        assert np.allclose(level[:-1], 20 * np.log10(peak[:-1]), atol=1e-3)
        at_lines = tab.numbers("signals.charts[1].marks.filter(({excited}) => excited).map(({value}) => value)")
        amplitude = np.sqrt(2 * power)[np.round(LINES.frequency_hz).astype(int)]
        assert np.allclose(at_lines, 20 * np.log10(amplitude), atol=1e-6)
        assert "two windows" not in tab.page.locator("#signals").inner_text()
        tab.js("signals.charts[1].made.setCursor({ left: signals.charts[1].made.valToPos(20, 'x'), top: 9 })")
        at_20_hz = f"20 Hz · {20 * np.log10(amplitude[0]):+.2f} dB".replace("-", "−")
        assert tab.page.locator(".signal[data-name=u] .at").inner_text() == at_20_hz
        tab.js("bode.view.choose('magnitude', 'absolute')")
        tab.until("signals.charts[1].made?.axes[1]._values?.includes('0.01')")
        assert np.array_equal(shown(tab, "u")[1], level), "other marks at the same places"
        tab.page.keyboard.press("e")
        assert tab.page.locator(".card.bode").is_hidden()
        tab.page.keyboard.press("e")
        assert tab.page.locator(".card.bode").is_visible()

        # A finished run without samples says so, over time and as a spectrum.
        tab.page.locator("#axis").select_option("1")
        tab.until("page.facts.name === 'whole' && signals.answer?.why_not === 'unrecorded'")
        assert words.inner_text() == "The samples of this time are not recorded: set samples = true under [record]."
        assert tab.js("signals.charts.length") == 0
        assert tab.wrong == []
    assert decoded(recorded_answer(watched.directory, None, 99.0, "time"), ())["why_not"] == "outside"
