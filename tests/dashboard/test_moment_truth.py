"""Drawn model, printed parameters and labelled time are of one fit at every moment: live, at the end, while seeking."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from playwright.sync_api import Browser

from livebode.dashboard import Dashboard, ServerSettings, grid_hz
from livebode.fitting import EvaluationGrid, model_named
from livebode.records import RunRecord
from tests.support.browser import Tab
from tests.support.dashboards import FIT, LINES, RATE_HZ, SAMPLES, Watched, whole_run

NAMES = ("Js", "Keff", "resonance")

# What the screen has at the end of each of its frames.
_WATCH = """() => {
  window.screens = [];
  let before = "";
  const keep = () => {
    requestAnimationFrame(keep);
    const { bode, parameters } = window.livebode;
    const series = bode.charts.length ? bode.seriesOf(0, "model") : -1;
    if (series < 0 || !bode.curves.model) return;
    const [measured, fit] = [bode.curves.measured, bode.curves.model].map((curve) => curve.frame.timeS[0]);
    const words = [...parameters.items.values()].map((item) => [item.name, item.words.textContent]);
    const printed = Object.fromEntries(words);
    const drawn = Array.from(bode.charts[0].data[series], (v) => Number.isFinite(v) ? v : null);
    const shown = document.getElementById("time-now").textContent;
    const paused = window.livebode.timeline.atS !== null;
    const screen = JSON.stringify({ measured, fit, printed, drawn, shown, paused });
    if (screen !== before) window.screens.push(screen);
    before = screen;
  };
  requestAnimationFrame(keep);
}"""


def screens(tab: Tab) -> list[dict[str, Any]]:
    return [json.loads(text) for text in tab.page.evaluate("() => window.screens.splice(0)")]


def fits(run: Path) -> dict[float, dict[str, tuple[float, float]]]:
    """Value and sigma of each recorded parameter, by effective time."""
    rows: dict[float, dict[str, tuple[float, float]]] = {}
    for table in map(pa.table, RunRecord.open(run).tables("parameters")):
        for row in table.to_pylist():
            if row["model"] == "two-mass":
                rows.setdefault(row["time_s"], {})[row["name"]] = row["value"], row["sigma"]
    return rows


def compare(found: list[dict[str, Any]], recorded: dict[float, dict[str, tuple[float, float]]]) -> set[float]:
    """Check every screen against the record; the times of the fits that they had."""
    model = model_named("two-mass", output="velocity", radius_m=FIT["radius_m"])
    grid = EvaluationGrid(grid_hz(LINES), RATE_HZ)
    for screen in found:
        fit = recorded[screen["fit"]]
        truth = 20 * np.log10(np.abs(model.at([fit[name][0] for name in model.names], grid)))
        assert np.allclose(screen["drawn"], truth, atol=3e-5, rtol=2e-6), screen["fit"]
        for name in NAMES:
            value, _, bound = (word.replace("−", "-") for word in screen["printed"][name].split()[:3])
            truth_value, sigma = fit[name]
            assert float(value) == pytest.approx(truth_value, abs=0.6 * 10 ** _place(value)), (name, screen["fit"])
            assert float(bound) == pytest.approx(1.96 * sigma, rel=0.06), (name, screen["fit"])
        if screen["paused"]:
            assert f"{screen['measured']:.2f}" in screen["shown"]
    return {screen["fit"] for screen in found}


def _place(number: str) -> int:
    """Power of ten of the last digit, as far as it was rounded."""
    head, _, decimals = number.partition(".")
    return -len(decimals) if decimals else len(head) - len(head.rstrip("0"))


def test_each_frame_of_a_live_run_has_one_fit_and_the_last_one_at_its_end(browser: Browser, tmp_path: Path) -> None:
    directory = tmp_path / "run"
    with Watched(directory) as watched:
        watched.go(2400)
        with Tab(browser, watched.url + "#tab=parameters&clock=run") as tab:
            tab.until("bode.curves.model && parameters.items.get('two-mass\\0Keff')?.words.textContent")
            tab.page.evaluate(_WATCH)
            seen = []
            for samples in range(2600, SAMPLES + 1, 400):
                watched.go(samples)
                tab.page.wait_for_timeout(60)
                seen += screens(tab)
            watched.end()
            tab.until("!timeline.span.live")
            recorded = fits(directory)
            newest_s = max(time_s for time_s, fit in recorded.items() if all(np.isfinite(fit[n][0]) for n in NAMES))
            tab.until(f"Math.abs(bode.curves.model?.frame.timeS[0] - {newest_s}) < 1e-6")
            tab.settle()
            seen += screens(tab)
            shown_s = compare(seen, recorded)
            assert len(shown_s) >= 5
            assert newest_s in shown_s
            assert newest_s == tab.js("bode.curves.measured.frame.timeS[0]"), "the last response has its own fit"
            assert tab.wrong == []


def test_each_moment_of_a_record_has_the_fit_of_its_response(browser: Browser, tmp_path: Path) -> None:
    directory = whole_run(tmp_path / "run")
    recorded = fits(directory)
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(directory)
    with dashboard, Tab(browser, dashboard.url + "#tab=parameters&clock=run") as tab:
        tab.until("bode.curves.model && parameters.items.get('two-mass\\0Keff')?.words.textContent")
        tab.page.evaluate(_WATCH)
        valid = sorted(time_s for time_s, fit in recorded.items() if all(np.isfinite(fit[n][0]) for n in NAMES))
        seen = screens(tab)
        for time_s in [*valid[::17], *valid[-3:], valid[0]]:
            tab.js(f"timeline.go({time_s})")
            tab.until(f"!page.seeking && Math.abs(bode.curves.measured.frame.timeS[0] - {time_s}) < 1e-6")
            tab.settle()
            assert tab.js("bode.curves.model.frame.timeS[0]") == pytest.approx(time_s, abs=1e-6)
            assert "fitted model at" not in tab.page.locator("#readout caption").inner_text()
            seen += screens(tab)
        assert len(compare(seen, recorded)) >= 10
        assert tab.wrong == []


def test_a_fit_of_another_moment_says_its_time(browser: Browser, tmp_path: Path) -> None:
    directory = whole_run(tmp_path / "run")
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(directory)
    with dashboard, Tab(browser, dashboard.url + "#clock=run") as tab:
        tab.until("bode.curves.model")
        frame = "{ ...bode.curves.model.frame, timeS: [bode.curves.measured.frame.timeS[0] - 0.5] }"
        tab.js(f"(bode.take({frame}), bode.draw())")
        tab.settle()
        time_s = tab.js("bode.curves.measured.frame.timeS[0]") - 0.5
        assert f"fitted model at {time_s:.2f} s" in tab.page.locator("#readout caption").inner_text()
        assert tab.wrong == []


def test_a_finished_recording_is_played_to_its_end(browser: Browser, tmp_path: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole_run(tmp_path / "run"))
    with dashboard, Tab(browser, dashboard.url + "#clock=run") as tab:
        button = tab.page.locator("#pause")
        tab.until("bode.curves.model")
        assert button.inner_text() == "Play"
        last_s = tab.js("timeline.span.last_s")
        button.click()
        assert button.inner_text() == "Pause"
        tab.until("timeline.atS > timeline.span.first_s + 0.2 && bode.curves.measured.frame.timeS[0] < 1")
        button.click()
        paused_s = tab.js("timeline.atS")
        assert button.inner_text() == "Play"
        tab.js(f"timeline.go({last_s} - 0.3)")
        button.click()
        tab.until("timeline.atS === null && !timeline.playing")
        tab.until(f"Math.abs(bode.curves.measured.frame.timeS[0] - {last_s}) < 1e-6")
        assert button.inner_text() == "Play"
        assert paused_s < last_s
        assert tab.wrong == []


def test_the_headline_is_the_result_of_the_fit_and_the_cursor_begins_there(browser: Browser, tmp_path: Path) -> None:
    directory = whole_run(tmp_path / "run")
    newest = RunRecord.open(directory).summary["fit"]["newest"]["quantities"]
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(directory)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.until("bode.curves.model && bode.aimed")
        tab.settle()
        words = tab.page.locator("#result").inner_text().split()
        assert words[0] == "Resonance"
        assert float(words[1]) == pytest.approx(newest["resonance"]["value"], abs=0.06)
        assert float(words[6]) == pytest.approx(100 * newest["resonance_damping"]["value"], rel=0.05)
        verdict = tab.page.locator("#verdict")
        assert verdict.inner_text() == "○ No baseline: not monitored"
        size = "(e) => e.checkVisibility() ? parseFloat(getComputedStyle(e).fontSize) : 0"
        sizes = tab.page.evaluate(f"() => Array.from(document.querySelectorAll('body *'), {size})")
        assert tab.page.locator("#result").evaluate(size) == max(sizes) > verdict.evaluate(size)
        near = {
            int(np.argmin(np.abs(np.log(LINES.frequency_hz / newest[name]["value"]))))
            for name in ("resonance", "antiresonance")
        }
        assert near <= set(tab.js("tracking.chosen")), "the lines that matter are tracked"
        assert (
            tab.js("bode.lines[bode.line]")
            == LINES.frequency_hz[int(np.argmin(np.abs(np.log(LINES.frequency_hz / newest["resonance"]["value"]))))]
        )
        assert tab.wrong == []


def test_without_a_fit_the_headline_is_the_largest_peak_between_its_lines(browser: Browser, tmp_path: Path) -> None:
    directory = whole_run(tmp_path / "run")
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(directory)
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.until("bode.curves.model")
        responses = RunRecord.open(directory).responses()
        newest = responses[int(np.flatnonzero(responses.valid.any(axis=1))[-1])]
        top = int(np.argmax(newest.magnitude_db[1:-1])) + 1
        # What the page has of a run without [fit].
        tab.page.evaluate(
            "async () => { const { resultWords } = await import('/static/result.js'); const { bode, page } = livebode;"
            " bode.drop('model'); bode.known.modes = () => [];"
            " window.words = resultWords(page.facts, bode, livebode.parameters); }"
        )
        low, high = LINES.frequency_hz[top - 1], LINES.frequency_hz[top + 1]
        assert tab.page.evaluate("() => words").startswith(f"Largest peak of |G| between {low:g} and {high:g} Hz: +")
        assert tab.wrong == []
