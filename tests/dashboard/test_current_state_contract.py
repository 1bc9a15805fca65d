"""What the page shows is of the axis and of the moment that it names: nothing of another axis, nothing old as new."""

from __future__ import annotations

import contextlib
import datetime
import re
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser

from livebode.core import Block, Channel, Event, Lines, Parameters
from livebode.dashboard import Dashboard, Hub, ServerSettings
from livebode.estimation import Tracker
from livebode.runtime import ClockSet, FitResults, TrackerResults
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode.sources.live import LiveBlock
from tests.support.browser import Tab
from tests.support.dashboards import LINES, SETTINGS, UNITS, begin, data
from tests.support.responses import made

ONE = Lines(LINES.bins[:1], LINES.window, RATE_HZ)


@contextlib.contextmanager
def axes(browser: Browser, *names: str, **options: object) -> Iterator[tuple[list[Hub], Tab]]:
    """A page of axes, of which the first has begun."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hubs = [dashboard.hub(name) for name in names]
    begin(hubs[0], Path("/nowhere"), LINES)
    with dashboard, Tab(browser, dashboard.url, **options) as tab:
        yield hubs, tab


def now(hub: Hub, *, at_s: float, ago_s: float = 0.0) -> None:
    """A machine has sent the samples up to this time of the run."""
    start = round(at_s * RATE_HZ) - 40
    block = LiveBlock(np.zeros((1, 40)), ("y",), RATE_HZ, start=start, arrived_s=time.monotonic() - ago_s)
    hub(TrackerResults(block, block.stop, None))


def status(tab: Tab) -> tuple[str, str]:
    """What is written beside the lamp, and how the lamp looks."""
    return tab.js("[document.getElementById('status-text').textContent, document.getElementById('lamp').className]")


def test_an_axis_whose_machine_never_sent_shows_nothing_of_another(browser: Browser) -> None:
    with axes(browser, "y", "z") as (hubs, tab):
        now(hubs[0], at_s=1.0)
        hubs[0](Event("change", 1, 0.1, "the belt's stiffness is 9 % less", {"what": "stiffness"}))
        tab.page.locator("#events [role=row].alarm").wait_for()
        tab.page.locator("#axis").select_option("1")
        tab.until("page.facts.name === 'z' && !page.facts.begun && page.facts.live")
        tab.page.wait_for_timeout(1200)  # what y goes on to send is not shown either
        assert status(tab) == ["z · waiting for the first samples", "lamp stale"]
        assert tab.js("[Object.keys(bode.curves), bode.charts.length, tracking.rows, map.cells]") == [[], 0, None, None]
        assert tab.js("document.title") == "z · livebode"
        for panel in ("#health", "#readout", "#quantities", "#tracking-lines"):
            assert tab.page.locator(panel).inner_text() == ""
        assert tab.page.locator("#events [role=row]").all_inner_texts() == ["no events yet"]
        assert tab.page.locator("#verdict").inner_text() == "○ Not assessed: waiting for the first samples"
        assert not tab.page.locator("#alarm-count").is_visible()
        for key in ("2", "ArrowRight", "f", " ", "d", "Escape", "p", "g", "m"):  # nothing to act on, and no error
            tab.page.keyboard.press(key)
        hubs[1](Event("waiting", 0, time.time(), "no samples arrived within 30 s; switch the machine on"))
        waiting = tab.page.locator("#events [role=row].alarm", has_text="switch the machine on")
        assert re.fullmatch(r"\d\d:\d\d:\d\d \S+", waiting.locator("time").inner_text())
        begin(hubs[1], Path("/nowhere"), ONE)  # its machine is switched on
        now(hubs[1], at_s=1.0)
        tab.until("bode.curves.measured?.frame.axis === 1 && bode.curves.measured.frame.columns === 1")
        tab.until("document.getElementById('lamp').className === 'lamp live'")
        assert tab.wrong == []


def test_a_page_that_is_opened_before_the_run_begins_shows_it_when_it_begins(browser: Browser) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hub = dashboard.hub("z")
    with dashboard, Tab(browser, dashboard.url, wait=False) as tab:
        tab.until("document.title === 'z · livebode' && !page.facts.begun && map.begun")
        assert status(tab) == ["z · waiting for the first samples", "lamp stale"]
        begin(hub, Path("/nowhere"), LINES)
        now(hub, at_s=1.0)
        tab.until("bode.curves.measured?.frame.axis === 0")
        assert tab.wrong == []


def test_a_visit_to_an_axis_with_one_line_leaves_the_choice_of_lines(browser: Browser) -> None:
    with axes(browser, "y", "z") as (hubs, tab):
        begin(hubs[1], Path("/nowhere"), ONE)
        tab.page.locator("#tracking-lines [data-line='1']").click()
        chosen = tab.js("tracking.chosen")
        assert 1 in chosen
        for axis, lines in (("1", 1), ("0", 13)):
            tab.page.locator("#axis").select_option(axis)
            tab.until(f"page.facts.begun && tracking.lines.length === {lines}")
        assert tab.js("tracking.chosen") == chosen
        assert tab.wrong == []


def test_the_lamp_is_green_only_while_samples_come_and_are_tracked(browser: Browser) -> None:
    with axes(browser, "y") as ([hub], tab):
        for at_s in (1.0, 1.1, 1.2):
            now(hub, at_s=at_s)
        tab.until("document.getElementById('lamp').className === 'lamp live'")
        tab.until("document.getElementById('lamp').className === 'lamp stale'")  # nothing has come for 2 s
        assert status(tab)[0].startswith("y · silent for ")
        assert tab.page.locator("#verdict").inner_text().startswith("◆ Check: no samples for ")
        behind = "{ up: true, facts: { begun: true }, health: { source: { connected: true }, backlog_s: 80 } }"
        words = f"import('/static/verdict.js').then((m) => m.lamp({behind}, {{ live: true }}, false))"
        assert tab.js(words) == ["80 s behind", "stale"]
        assert tab.wrong == []


def test_the_sentence_says_what_has_changed_until_it_is_over(browser: Browser) -> None:
    with axes(browser, "y") as ([hub], tab):
        now(hub, at_s=1.0)
        word = tab.page.locator("#verdict")
        assert re.match("○ No baseline: not monitored|◆ Check: no samples for ", word.inner_text())
        change = {"what": "stiffness", "amount_percent": -9.04, "since_s": 0.05}
        hub(Event("change", 1, 0.1, "stiffness is 9 % less", change))
        word.get_by_text("⚠ ALARM: belt 9.0 % softer since 0.05 s").wait_for()
        assert "stiffness" in word.get_attribute("title")
        hub(Event("change", 1, 0.1, "load", {"what": "load", "amount_percent": 20.0, "since_s": 0.08, "place_m": 0.35}))
        word.get_by_text("⚠ ALARM: belt 9.0 % softer, and 1 more since 0.05 s").wait_for()
        hub(Event("change-cleared", 2, 0.2, "stiffness is as learned", {"what": "stiffness"}))
        word.get_by_text("⚠ ALARM: load 20.0 % heavier at 0.35 m since 0.08 s").wait_for()
        hub(Event("change-cleared", 2, 0.2, "load", {"what": "load", "place_m": 0.35}))
        word.get_by_text("◆ Check: ").wait_for()  # nobody has acknowledged them
        now(hub, at_s=1.1)
        word.get_by_text("◆ Check: 2 alarms not acknowledged since 0.05 s").wait_for()
        assert tab.wrong == []


def test_alarms_of_one_cause_are_one_row_and_acknowledged_at_once(browser: Browser) -> None:
    with axes(browser, "y") as ([hub], tab):
        for i in range(1065):
            hub(Event("gap", i, i / 10, f"{i} samples are missing"))
        hub(Event("change", 7, 200.0, "stiffness is 9 % less", {"what": "stiffness"}))
        tab.until("document.querySelectorAll('#events [role=row].alarm').length === 2")
        assert tab.page.locator("#alarm-count").inner_text() == "⚠ 2 alarms"
        row = tab.page.locator("#events [role=row][data-cause=gap]")
        assert "1064 samples are missing" in row.inner_text()
        assert "1065 times since 0.00 s" in row.inner_text()
        assert row.locator("time").inner_text() == "106.40 s"
        row.get_by_role("button", name="Acknowledge all 1065").click()
        tab.page.get_by_label("Your name").fill("Ann")
        tab.page.keyboard.press("Enter")
        tab.until("events.waiting.size === 1")
        (acknowledged,) = _until_acknowledged(hub)
        assert (acknowledged.details["cause"], acknowledged.details["count"]) == ("gap", 1065)
        hub(acknowledged)
        tab.until("document.querySelector('#events [role=row][data-cause=gap]').className.includes('seen')")
        assert tab.page.locator("#alarm-count").inner_text() == "⚠ 1 alarm"
        hub(Event("gap", 2000, 300.0, "5 samples are missing"))
        row.get_by_role("button", name="Acknowledge all 1066: 5 samples").wait_for()
        assert tab.wrong == []


def _until_acknowledged(hub: Hub) -> list[Event]:
    for _ in range(1000):
        assert hub.control is not None
        if found := hub.control.take_recorded():
            return found
        time.sleep(0.01)
    raise AssertionError("nothing was acknowledged")


def margins(time_s: float, gain_db: float) -> Parameters:
    one = np.array([time_s])
    return Parameters(
        "margins", ("gain_margin",), ("dB",), np.array([[gain_db]]), np.array([[[0.01]]]), np.array(["ok"]), one * 0,
        np.ones(1), np.ones(1), np.zeros(1, dtype=np.int64), one, one * np.nan,
    )  # fmt: skip


def test_margins_are_those_of_the_moment_that_is_shown(browser: Browser) -> None:
    with axes(browser, "y") as ([hub], tab):
        cell = tab.page.locator("#pane-margins [data-name=gain_margin] td").first
        tab.page.keyboard.press("g")
        span = tab.js("timeline.span")
        for share, gain_db in ((0.1, 12.0), (1.0, 7.0)):
            hub(FitResults((margins(span["first_s"] + share * (span["last_s"] - span["first_s"]), gain_db),)))
            tab.page.locator("#pane-margins", has_text=f"{gain_db:.2f} ± 0.20 dB").wait_for()
        tab.page.locator("#time").focus()
        tab.page.keyboard.press("Home")
        tab.page.locator("#pane-margins", has_text="12.00 ± 0.20 dB").wait_for()
        hub(FitResults((margins(span["last_s"] + 1, 3.0),)))
        tab.page.wait_for_timeout(800)
        assert cell.inner_text() == "12.00 ± 0.20 dB"
        tab.page.keyboard.press(" ")
        tab.page.locator("#pane-margins", has_text="3.00 ± 0.20 dB ⚠ small").wait_for()
        assert tab.wrong == []


BERLIN = datetime.timezone(datetime.timedelta(hours=2))


def test_moments_are_times_of_day_where_a_machine_sends(browser: Browser) -> None:
    """In the viewer's zone, named; on the tracking's axis the same moment keeps its label while time goes on."""
    with axes(browser, "y", timezone_id="Europe/Berlin") as ([hub], tab):
        at = datetime.datetime(2026, 7, 14, 14, 32, 7, tzinfo=BERLIN).timestamp()
        begin(hub, Path("/nowhere"), LINES, from_s=at)
        hub(Event("change", 1, at, "stiffness is 9 % less", {"what": "stiffness"}))
        tab.page.locator("#events [role=row].alarm time", has_text="2026-07-14 14:32:07 CEST").wait_for()
        assert tab.page.locator("#time-from").inner_text().startswith("2026-07-14 14:32:0")
        tab.until("tracking.made.axes[0].label() === 'time on 2026-07-14, CEST'")
        tab.until("tracking.made.axes[0]._values?.length")
        ticks, splits = tab.js("(({ _values: v, _splits: s }) => [v, s])(tracking.made.axes[0])")
        for text, split in zip(ticks, splits):
            local = datetime.datetime.fromtimestamp(split + 1e-6, BERLIN)
            assert text == f"{local:%H:%M:%S.%f}"[: len(text)]
        rows = made(30, LINES, hole=0.0, unit="")
        hub(replace(rows, time_s=rows.time_s + at + 3.7))
        tab.until(f"timeline.span.last_s > {at + 3}")
        tab.until(f"tracking.toS > {at + 3}")
        assert tab.js(f"Math.abs(tracking.made.data[0].at(-1) - {at + 3.7}) < 2")
        tab.page.keyboard.press(" ")
        tab.page.locator("#time-now", has_text="CEST").wait_for()
        tab.page.locator("#readout caption", has_text="CEST").wait_for()
        assert tab.wrong == []


def test_a_live_run_without_stamps_has_the_time_of_day_and_a_recording_its_own(browser: Browser) -> None:
    with axes(browser, "y", timezone_id="Europe/Berlin") as ([hub], tab):
        assert tab.page.locator("#time-from").inner_text().endswith(" s")
        assert tab.js("tracking.made.axes[0].label()") == "time in s"
        now(hub, at_s=0.5, ago_s=0.0)
        hub(ClockSet(((0.0, time.time() - 7200), (10.0, time.time()))))
        tab.page.locator("#time-from", has_text="CE").wait_for()
        tab.until("tracking.made.axes[0].label().includes(', CE')")
        assert tab.wrong == []


def test_the_map_of_an_average_without_a_position_is_over_time(browser: Browser) -> None:
    tracker = Tracker(replace(SETTINGS, average=True, schedule=None))
    channels = tuple(Channel(name, unit) for name, unit in UNITS.items())
    responses = tracker.process(Block(data(), channels, RATE_HZ, start=0))
    assert not np.isfinite(responses.schedule).any()
    assert np.count_nonzero(responses.time_s == 0) == 0
    with axes(browser, "y") as ([hub], tab):
        begin(hub, Path("/nowhere"), LINES, rows=responses)
        tab.page.locator("#tracking-span [data-value=whole]").click()
        tab.until("map.cells?.columns > 10")
        assert tab.js("map.cells.moving") is False
        assert tab.wrong == []
