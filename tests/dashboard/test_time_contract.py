"""Clocks when daylight saving ends and begins, zoom in time, what survives a reload; pictures, print, lost data."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser
from pypdf import PageObject, PdfReader

from livebode.core import Event, Lines
from livebode.dashboard import Dashboard, ServerSettings
from livebode.language import Message, Moment
from livebode.records import RunRecord
from livebode.runtime import ClockSet
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.browser import Tab
from tests.support.dashboards import LINES, Watched, begin, whole_run
from tests.support.responses import made

AUTUMN = datetime(2026, 10, 24, 23, tzinfo=UTC), 4.0
SPRING = datetime(2026, 3, 28, 23, 30, tzinfo=UTC), 3.0
ROWS = 120
MEASURED, MODEL, INK, MUTED = (0x00, 0x72, 0xB2), (0xB3, 0x47, 0x00), (0x1D, 0x27, 0x33), (0x56, 0x62, 0x70)
WHITE, DARK = (255, 255, 255), (0x14, 0x1B, 0x23)
MARGIN_PT = 12 / 25.4 * 72
# Pixels of every chart: a picture leaves no trace on the screen.
SCREEN = "[...document.querySelectorAll('.uplot canvas')].map((c) => c.toDataURL()).join()"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole_run(tmp_path_factory.mktemp("time") / "run")


@pytest.fixture(scope="module")
def dashboard(whole: Path) -> Iterator[Dashboard]:
    """Hours across the two changes of the clocks in Europe, and a finished recording without a date."""
    found = Dashboard(ServerSettings("127.0.0.1", 0))
    for name, (start, hours) in {"autumn": AUTUMN, "spring": SPRING}.items():
        hub = found.hub(name)
        rows = replace(made(ROWS, LINES, hole=0.0, unit=""), time_s=np.linspace(0, 3600 * hours, ROWS))
        begin(hub, whole.parent, LINES, rows=rows)
        hub(ClockSet([(0.0, start.timestamp())]))
    found.view(whole)
    with found:
        yield found


@pytest.fixture(scope="module")
def tab(browser: Browser, dashboard: Dashboard) -> Iterator[Tab]:
    with Tab(browser, dashboard.url, timezone_id="Europe/Berlin", locale="en-GB") as found:
        found.context.grant_permissions(["clipboard-read", "clipboard-write"])
        yield found
        assert found.wrong == []


def show(tab: Tab, address: str) -> None:
    """The page at an address, as if it was typed: the page loads again."""
    tab.page.goto("about:blank")
    tab.page.goto(f"{tab.url}#{address}")
    tab.until("window.livebode && bode.curves.measured && page.seen && tracking.made.data[0].length")


def marks(tab: Tab) -> list[str]:
    return list(tab.js("tracking.made.axes[0]._values"))


def notice(tab: Tab) -> str:
    return str(tab.page.locator("#notice").inner_text())


def test_marks_are_round_times_of_day_across_a_change_of_the_clocks(tab: Tab) -> None:
    show(tab, "axis=autumn&span=whole")
    tab.until("tracking.toS === 14400")
    assert marks(tab) == ["01:00 CEST", "02:00 CEST", "02:00 CET", "03:00 CET", "04:00 CET"]
    assert tab.js("tracking.made.axes[0].label()") == "time on 2026-10-25, CEST → CET"
    tab.page.locator("#tab-map").click()
    assert tab.page.locator("#time-from").inner_text() == "2026-10-25 01:00:00 CEST"
    assert tab.page.locator("#time-to").inner_text() == "2026-10-25 04:00:00 CET"
    tab.page.keyboard.press("z")  # UTC does not change
    tab.until("tracking.made.axes[0]._values[0] === '23:00'")
    assert "10-25" in marks(tab), "midnight is the date"
    assert tab.js("tracking.made.axes[0].label()") == "time on 2026-10-24 … 2026-10-25, UTC"
    tab.page.keyboard.press("z")
    tab.until("tracking.made.axes[0]._values.at(-1) === '4:00:00'")
    assert marks(tab) == [f"{hour}:00:00" for hour in (1, 2, 3, 4)]
    assert tab.page.locator("#time-to").inner_text() == "4 h 0 min 0 s"
    show(tab, "axis=spring&span=whole")
    tab.until("tracking.toS === 10800")
    found = marks(tab)
    assert found == ["01:00 CET", "03:00 CEST", "04:00 CEST"], "two o'clock does not exist"


def test_marks_are_round_apart_and_in_order_at_every_span(tab: Tab) -> None:
    """Over spans from 10 ms to two years from moments near the change: in both clocks marks ascend and fit."""
    show(tab, "axis=autumn&span=whole")
    starts = [7190.0, -86400.0, 0.0]
    found = tab.page.evaluate(
        """async (starts) => {
          const { timeMarks, timeSplits } = await import('/static/time-ticks.js');
          const { wallS } = await import('/static/clock.js');
          const all = [];
          for (const from of starts) for (let size = 0.01; size < 6e7; size *= 1.7) {
            const at = timeSplits(from, from + size, 480);
            all.push([size, at, timeMarks(at), at.map(wallS)]);
          }
          return all;
        }""",
        starts,
    )
    for size, at, words, wall_s in found:
        gaps = np.diff(at)
        assert 1 <= len(at) <= 16, size
        assert len(set(words)) == len(words) or size > 43200, words
        if len(gaps):
            assert gaps.min() > 0
            steps = [round(gap) if gap > 0.9 else float(f"{gap:.2g}") for gap in gaps]
            steps += [step + hour for step in steps for hour in (-3600, 3600) if step > 7200]
            off = [np.abs((np.asarray(wall_s) + step / 2) % step - step / 2).max() for step in steps]
            assert min(off) < 1e-4, (size, words)
            assert np.ptp(gaps) <= 7200.001, "an hour more in autumn, one less in spring"


def test_what_was_chosen_survives_a_reload_and_is_shared(tab: Tab) -> None:
    show(tab, "axis=run")
    page = tab.page
    page.locator("#quantities [data-value='open loop']").click()
    tab.until("bode.curves.measured?.frame.quantity === 'open loop'")
    page.locator("#tracking-what [data-value=phase]").click()
    page.locator("#tracking-over [data-value=position]").click()
    page.locator("#tracking-span [data-value='120']").click()
    page.locator("#map-what [data-value=change]").click()
    page.locator("#tracking-lines [data-line='1']").click()
    lines = tab.js("tracking.chosen")
    tab.js("timeline.go(1.2)")
    tab.until("!page.seeking")
    page.keyboard.press("l")
    page.locator("#notice", has_text="was copied").wait_for()
    link = page.evaluate("navigator.clipboard.readText()")
    kept = "[page.facts.name, page.quantity, tracking.what, tracking.over, page.spanS, map.what, timeline.atS]"
    for again in (page.reload, lambda: show(tab, link.partition("#")[2])):
        again()
        tab.until("window.livebode && bode.curves.measured && timeline.atS !== null && !page.seeking")
        assert tab.js(kept) == ["run", "open loop", "phase", "position", "120", "change", 1.2]
        assert sorted(tab.js("tracking.chosen")) == sorted(lines)
        assert page.locator("#axis").input_value() == "2"
    page.locator("#axis").select_option("0")
    tab.until("page.facts.name === 'autumn' && bode.curves.measured?.frame.axis === 0")
    tab.js("timeline.go(6000)")
    page.wait_for_timeout(450)
    words = tab.js("location.hash")
    assert "axis=" not in words, "the first axis needs no name"
    assert "quantity" not in words
    assert quote("2026-10-25T00:40:00.000Z") in words, "a moment is a time of day if the run has a clock"
    tab.js("location.hash = 'axis=spring'")  # typed into the address, or gone back to
    tab.until("window.livebode && page.facts?.name === 'spring' && bode.curves.measured")
    assert tab.js("timeline.atS") is None


def test_an_address_that_names_nothing_gives_one_sentence(tab: Tab) -> None:
    show(tab, "axis=winter")
    assert notice(tab) == "No axis is named winter; autumn is shown."
    show(tab, "at=2026-10-25T05:00:00Z")
    assert notice(tab).startswith("2026-10-25 06:00:00 CET is not in the record, which covers 2026-10-25 01:00:00 CEST")
    assert tab.js("timeline.atS") == 14400
    show(tab, "at=yesterday&quantity=mood&track=colour&span=7&clock=moon")
    assert notice(tab) == "yesterday in the address is not a time of this run."
    assert tab.js("[page.quantity, tracking.what, page.spanS]") == ["plant", "magnitude", "20"]


def under(x: float) -> str:
    """JavaScript for the time at a place of the screen."""
    box = "tracking.made.over.getBoundingClientRect()"
    return f"((b, [from, to]) => from + ({x} - b.left) / b.width * (to - from))({box}, zoom.seen)"


def test_the_tracking_plot_zooms_in_time_with_data_of_the_record(tab: Tab, whole: Path) -> None:
    show(tab, "axis=run&span=whole")
    page = tab.page
    box = page.locator("#tracking .u-over").bounding_box()
    assert box
    x = [box["x"] + share * box["width"] for share in (0.2, 0.8)]
    y = box["y"] + box["height"] / 2
    expected = [tab.js(under(place)) for place in x]
    page.mouse.move(x[0], y)
    page.mouse.down()
    page.mouse.move(x[1], y, steps=3)
    page.mouse.up()
    tab.until("page.zoom && page.past?.from === page.zoom[0]")
    assert tab.js("page.zoom") == pytest.approx(expected, abs=0.02)
    assert tab.js("timeline.atS") is None, "a drag is not a click"
    run = RunRecord.open(whole).responses()
    from_s, to_s = tab.js("page.zoom")
    inside = run.time_s[(run.time_s >= from_s) & (run.time_s <= to_s)]
    assert tab.numbers("page.past.frame.timeS").tolist() == inside.tolist(), "every response of the record"
    tab.until("page.seen[1] === page.zoom[0]")
    assert tab.js("[tracking.made.scales.x.min, tracking.made.scales.x.max]") == [from_s, to_s]
    page.locator("#tab-parameters").click()
    tab.until("[...parameters.items.values()].some((item) => item.made?.scales.x.min === page.zoom[0])")
    page.locator("#tab-margins").click()
    tab.until("marginTrends.items.get('margins\\0phase_margin').made?.scales.x.max === page.zoom[1]")

    tab.reload()
    tab.until("window.livebode && page.zoom && bode.curves.measured && page.seen?.[1] === page.zoom[0]")
    assert tab.js("page.zoom") == pytest.approx([from_s, to_s], abs=1e-3)
    page.mouse.move(x[0] + 100, y)
    at = under(x[0] + 100)
    before = tab.js(at)
    page.mouse.wheel(0, -200)
    tab.until(f"page.zoom[1] - page.zoom[0] < {0.5 * (to_s - from_s)}")
    assert tab.js(at) == pytest.approx(before, abs=1e-3), "the time under the wheel stays"
    size = tab.js("page.zoom[1] - page.zoom[0]")
    page.locator("#tracking").focus()
    page.keyboard.press("ArrowRight")
    tab.until(f"page.zoom[1] - page.zoom[0] > {0.99 * size}")
    assert tab.js(at) == pytest.approx(before + 0.2 * size, abs=2e-3)
    page.keyboard.press("-")
    assert tab.js("page.zoom[1] - page.zoom[0]") == pytest.approx(1.5 * size)
    pinch(tab, box)
    page.mouse.dblclick(x[0], y)
    tab.until("page.zoom === null && page.seen?.[2] > 2.9")
    assert tab.js("timeline.atS") is None, "two clicks show all, and do not pause"
    assert not page.locator("#zoomed").is_visible()
    tab.until("!location.hash.includes('from')")


def pinch(tab: Tab, box: dict[str, float]) -> None:
    """Two fingers that move apart to three times their distance show a third of the span."""
    cdp = tab.context.new_cdp_session(tab.page)
    before = tab.js("page.zoom[1] - page.zoom[0]")

    def fingers(kind: str, half: float) -> None:
        middle, y = box["x"] + box["width"] / 2, box["y"] + 60
        at = [{"x": middle + sign * half, "y": y, "id": i} for i, sign in enumerate((-1, 1))]
        cdp.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [] if kind == "touchEnd" else at})

    fingers("touchStart", 30)
    for half in (50, 70, 90):
        fingers("touchMove", half)
    fingers("touchEnd", 90)
    assert tab.js("page.zoom[1] - page.zoom[0]") == pytest.approx(before / 3, rel=0.05)


def test_what_a_run_does_not_have_is_absent_and_an_address_that_asks_for_it_gets_the_reason(tab: Tab) -> None:
    show(tab, "axis=autumn&over=position")
    assert tab.page.locator("#tracking-over button").count() == 0
    assert tab.js("tracking.over") == "time"
    assert "name its channel as schedule" in notice(tab)
    tab.page.locator("#axis").select_option("2")
    tab.until("page.facts.name === 'run' && bode.curves.measured?.frame.axis === 2")
    assert tab.js("tracking.over") == "position", "the choice waited for an axis that has a position"
    clock = tab.page.locator("#clock")
    assert clock.is_disabled()
    assert "has no time of day" in str(clock.get_attribute("title"))


def test_no_time_is_before_the_start_of_a_recording(tab: Tab, whole: Path) -> None:
    """Windows that begin before the recording have their centre there: these responses have no valid line."""
    run = RunRecord.open(whole).responses()
    assert run.time_s[0] < 0
    show(tab, "axis=run&span=whole")
    first_s = run.time_s[run.valid.any(axis=1)][0]
    assert tab.js("timeline.span.first_s") == pytest.approx(first_s)
    tab.until("tracking.fromS > 0")
    assert "−" not in tab.page.locator("#time-from").inner_text()
    assert "-" not in repr(run).partition("Hz, ")[2]
    assert json.dumps(tab.js("tracking.made.data[0][0] >= 0")) == "true"


def ask(tab: Tab, what: str, width: int, height: int, theme: str = "light") -> None:
    """Fill in the dialog."""
    page = tab.page
    page.locator("#download").click()
    page.locator("#download-menu button", has_text="picture (PNG)").click()
    page.locator("#export-what").select_option(what)
    page.locator("#export-width").fill(str(width))
    page.locator("#export-height").fill(str(height))
    page.locator("#export-theme").select_option(theme)


def download(tab: Tab, what: str, width: int, height: int, theme: str = "light") -> np.ndarray:
    """The pixels of a picture."""
    ask(tab, what, width, height, theme)
    with tab.page.expect_download() as waiting:
        tab.page.locator("#export-form [type=submit]").click()
    ending = "" if what == "bode" else f"-{what}"
    assert waiting.value.suggested_filename == f"run-plant-2.95s{ending}.png"
    with Image.open(waiting.value.path()) as picture:
        assert picture.size == (width, height)
        return np.asarray(picture.convert("RGB")).astype(int)


def count(pixels: np.ndarray, colour: tuple[int, int, int]) -> int:
    return int(np.count_nonzero((pixels == colour).all(axis=-1)))


def test_a_picture_has_the_size_legend_and_colours_asked_for_and_no_cursor(tab: Tab) -> None:
    show(tab, "axis=run&span=whole")
    tab.until("tracking.toS > 2.9 && map.cells")
    tab.page.keyboard.press("ArrowRight")
    tab.page.mouse.move(5, 5)
    tab.page.wait_for_timeout(200)
    before = tab.js(SCREEN)
    pixels = download(tab, "bode", 1000, 700)
    head, body, foot = pixels[:80], pixels[80:-18], pixels[-18:]
    assert tuple(pixels[0, 0]) == WHITE
    assert count(head, MEASURED) > 25, "the legend"
    assert count(head, MODEL) > 10, "dashes of the legend"
    assert count(head, INK) > 50, "the title"
    assert np.count_nonzero(foot.min(axis=-1) < 200) > 50, "the version"
    assert count(body, MEASURED) > 500, "13 points with their bars, in two charts"
    assert count(body, INK) == 0, "no ring around a line, which is in ink"
    smaller = download(tab, "bode", 600, 300, "dark")
    assert tuple(smaller[0, 0]) == DARK
    tracking, levels = download(tab, "tracking", 900, 500), download(tab, "map", 900, 500)
    assert count(tracking[:80], MEASURED) > 5, "the first of the tracked lines in the legend"
    thin = np.abs(tracking[80:] - MEASURED).max(axis=-1) < 60  # mixed with the ground at their edges
    assert np.ptp(np.flatnonzero(thin.any(axis=0))) > 600, "curves over the whole width"
    assert len(np.unique(levels[120:400, 100:700].reshape(-1, 3), axis=0)) > 20, "the colours of the levels"
    tab.page.wait_for_timeout(100)
    assert tab.js(SCREEN) == before, "the screen is as before"
    ask(tab, "bode", 9, 9)
    tab.page.locator("#export-form [type=submit]").click()
    assert tab.page.locator("#export").get_attribute("open") is not None, "the field refuses 9 pixels"
    tab.page.locator("#export-cancel").click()


def boxes(page: PageObject) -> list[list[float]]:
    """Left, bottom, right and top of the pictures on a page, pt."""
    found: list[list[float]] = []

    def visit(operator: bytes, _: Any, matrix: list[float], __: Any) -> None:
        if operator == b"Do":
            width, _b, _c, height, left, bottom = matrix
            found.append([left, bottom, left + width, bottom + height])

    page.extract_text(visitor_operand_before=visit)
    return found


@pytest.mark.parametrize(("paper", "landscape"), [("A4", False), ("Letter", True)])
def test_a_printed_page_has_whole_curves_inside_its_margins(
    tab: Tab, tmp_path: Path, paper: str, landscape: bool
) -> None:
    show(tab, "axis=run&span=whole")
    tab.until("tracking.toS > 2.9 && map.cells")
    tab.page.pdf(path=tmp_path / "page.pdf", format=paper, landscape=landscape)
    pages = PdfReader(tmp_path / "page.pdf").pages
    assert len(pages) <= 4
    width, height = float(pages[0].mediabox.width), float(pages[0].mediabox.height)
    assert (width > height) == landscape
    found = [box for page in pages for box in boxes(page)]
    assert len(found) == 4, "magnitude, phase, coherence and tracking"
    for left, bottom, right, top in found:
        assert min(left, width - right) > MARGIN_PT - 1
        assert min(bottom, height - top) > MARGIN_PT - 1
        assert right - left > 400
    magnitude = np.asarray(next(image for page in pages for image in page.images).image.convert("RGBA")).astype(int)
    blue = np.flatnonzero((magnitude[..., :3] == MEASURED).all(axis=-1).any(axis=0))
    assert np.ptp(blue) > 0.85 * magnitude.shape[1], "from the first to the last line, in the colours of light"
    text = "".join(page.extract_text() for page in pages)
    for words in ("run · livebode", "not monitored", "phase margin", "a sample is not", "13 lines", "2.95 s"):
        assert words in text
    for words in ("Download", "Freeze", "alarms only"):
        assert words not in text
    assert len(boxes(pages[0])) >= 3, "the Bode plot is on the first page"
    assert tab.js("document.getElementById('sheet').childElementCount") == 0


def test_a_lost_server_greys_the_plots_and_says_since_when(browser: Browser, tmp_path: Path) -> None:
    with Watched(tmp_path / "run") as watched, Tab(browser, watched.url, wait=False) as tab:
        watched.go(2000)
        tab.until("window.livebode?.bode.curves.measured")
        words = tab.page.locator("#lost")
        words.filter(has_text=re.compile(r"No samples from the machine since \d\d:\d\d:\d\d \S+; the plots")).wait_for()
        grey = "getComputedStyle(document.getElementById('magnitude')).filter"
        assert "grayscale(1)" in tab.js(grey)
        watched.go(3000)
        words.wait_for(state="hidden")
        assert tab.js(grey) == "none"
        port = int(tab.url.rsplit(":", 1)[1].strip("/"))
        watched.dashboard.__exit__()
        words.filter(has_text=re.compile(r"No connection to the server since \d\d:\d\d:\d\d \S+; the plots")).wait_for()
        assert "grayscale(1)" in tab.js(grey)
        status = "document.getElementById('status-text').textContent"
        assert "no connection" in tab.js(status)
        again = Dashboard(ServerSettings("127.0.0.1", port))
        watched.end()
        again.view(watched.directory)
        with again:
            words.wait_for(state="hidden")
            assert tab.js(grey) == "none"
            tab.until(f"{status}.includes('recorded')")
        watched.dashboard.__enter__()


def test_a_server_that_ends_with_its_run_is_not_lost(browser: Browser, tmp_path: Path) -> None:
    """As after Ctrl-C: the run ends, and the server directly behind it."""
    with Watched(tmp_path / "run") as watched, Tab(browser, watched.url, wait=False) as tab:
        watched.go(2000)
        tab.until("window.livebode?.bode.curves.measured")
        verdict = tab.page.inner_text("#verdict")
        watched.end()
        tab.until("page.health?.ending || document.getElementById('status-text').textContent.includes('recorded')")
        watched.dashboard.__exit__()
        tab.page.locator("#lost", has_text="The run and its server ended at").wait_for()
        assert "recorded" in tab.page.inner_text("#status-text")
        assert tab.page.inner_text("#verdict") == verdict
        assert tab.js("getComputedStyle(document.getElementById('magnitude')).filter") == "none"
        watched.dashboard.__enter__()


def test_a_new_run_ends_the_zoom_of_the_one_before(browser: Browser, tmp_path: Path) -> None:
    found = Dashboard(ServerSettings("127.0.0.1", 0))
    hub = found.hub("axis")
    begin(hub, tmp_path, LINES)
    with found, Tab(browser, found.url) as tab:
        tab.until("tracking.made.data[0].length")
        tab.js("zoom.set(0.1, 0.15)")
        tab.until("page.zoom && page.past")
        begin(hub, tmp_path, Lines(LINES.bins[:6], LINES.window, RATE_HZ), from_s=347.0)
        tab.until("timeline.span.first_s > 346 && page.zoom === null && tracking.fromS > 346")
        assert tab.wrong == []


def test_the_sentence_and_the_recorded_messages_follow_the_chosen_clock(tab: Tab, dashboard: Dashboard) -> None:
    since_s = 9000.0  # half past two for the second time
    unix_s = AUTUMN[0].timestamp() + since_s
    change = "the belt's stiffness is 2.0 ± 0.2 % less than in the baseline"
    message = Message("Since {since} {change}.", since=Moment(since_s, unix_s, 1), change=change)
    facts = {"what": "stiffness", "amount_percent": -2.0, "since_s": since_s, "place_m": None}
    dashboard.hub("autumn")(Event("change", 0, since_s + 60, message, facts))
    show(tab, "axis=autumn")
    row = "document.querySelector('#events [data-cause=\"change: stiffness\"] p')?.textContent"
    for sentence, moment in (
        ("since 2026-10-25 02:30", "Since 2026-10-25 02:30:00 CET the belt's"),
        ("since 2026-10-25 01:30 UTC", "Since 2026-10-25 01:30:00 UTC the belt's"),
        ("since 2 h 30 min 0 s", "Since 9000.0 s the belt's"),
    ):
        tab.until(f"verdict.textContent.endsWith({json.dumps(sentence)}) && {row}?.includes({json.dumps(moment)})")
        assert moment in tab.js("verdict.title")
        tab.page.keyboard.press("z")
