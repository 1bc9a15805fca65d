"""The dashboard used as a person does: keys, touch, freezing, scrolling back, downloads, acknowledging, light, dark."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser
from scipy.io import loadmat

from livebode.core import Event, Lines
from livebode.dashboard import Dashboard, Hub, ServerSettings
from livebode.records import RunRecord
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.browser import TABLET, Tab, until
from tests.support.dashboards import LINES, Watched, begin, whole_run
from tests.support.responses import made


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    with Watched(tmp_path / "run") as found:
        found.go(6000)
        yield found


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole_run(tmp_path_factory.mktemp("whole") / "run")


@pytest.fixture(scope="module")
def without_loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return whole_run(tmp_path_factory.mktemp("whole") / "other", loop=None)


def shown_s(tab: Tab) -> float:
    return float(tab.js("bode.curves.measured.frame.timeS[0]"))


def test_freezing_pausing_and_scrolling_back(browser: Browser, watched: Watched) -> None:
    with Tab(browser, watched.url) as tab:
        page = tab.page
        tab.until("bode.curves.measured.frame.timeS[0] > 1.44")
        before = tab.numbers("bode.curves.measured.frame.magnitude")
        page.keyboard.press("f")
        tab.until("bode.curves.reference")
        watched.go(8000)
        tab.until("bode.curves.measured.frame.timeS[0] > 1.9")
        assert np.array_equal(tab.numbers("bode.curves.reference.frame.magnitude"), before)
        assert not np.array_equal(tab.numbers("bode.curves.measured.frame.magnitude"), before)
        page.locator("#readout [data-name=reference]").wait_for()  # text is written a few times a second

        page.keyboard.press("2")  # the reference goes with the quantity
        tab.until("bode.curves.reference?.frame.quantity === 'open loop'")
        page.keyboard.press("1")
        tab.until("bode.curves.reference?.frame.quantity === 'plant'")

        page.keyboard.press(" ")
        tab.until("timeline.atS !== null && !page.seeking")
        stood = shown_s(tab)
        watched.go(10_000)
        tab.until("timeline.span.last_s > 2.3")
        assert shown_s(tab) == stood
        assert page.locator("#status-text").inner_text().endswith("paused")

        page.locator("#time").focus()
        page.keyboard.press("Home")
        tab.until("!page.seeking && bode.curves.measured.frame.timeS[0] < 0.3")
        page.keyboard.press(".")
        tab.until("timeline.atS > timeline.span.first_s + 0.09")
        run = watched.record().responses()
        expected = run.time_s[run.valid.any(axis=1)]
        tab.until("!page.seeking")
        page.wait_for_timeout(150)
        nearest = expected[np.argmin(np.abs(expected - tab.js("timeline.atS")))]
        assert shown_s(tab) == pytest.approx(nearest, abs=1e-9)
        at = int(np.flatnonzero(run.time_s == nearest)[0])
        assert np.allclose(tab.numbers("bode.curves.measured.frame.magnitude"), run[at].magnitude_db, atol=2e-5)

        page.keyboard.press(" ")
        tab.until("timeline.atS === null && bode.curves.measured.frame.timeS[0] > 2.3")
        page.keyboard.press("u")
        tab.until("!bode.curves.reference")
        assert tab.wrong == []


@contextlib.contextmanager
def page_of_a_run(browser: Browser, directory: Path) -> Iterator[tuple[Hub, Tab]]:
    """A page on which a run has begun; the hub begins others."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hub = dashboard.hub("axis")
    begin(hub, directory, LINES)
    with dashboard, Tab(browser, dashboard.url) as tab:
        yield hub, tab


def test_a_new_run_with_other_lines_lets_the_reference_go(browser: Browser, tmp_path: Path) -> None:
    with page_of_a_run(browser, tmp_path) as (hub, tab):
        tab.page.keyboard.press("f")
        tab.page.keyboard.press("2")
        tab.until("bode.curves.reference?.frame.quantity === 'open loop'")
        begin(hub, tmp_path, Lines(LINES.bins[:6], LINES.window, RATE_HZ))
        tab.until("bode.curves.measured?.frame.columns === 6")
        tab.page.locator("#notice", has_text="the references were released").wait_for()
        assert not tab.page.locator("#legend [data-name=reference]").is_visible()
        tab.page.wait_for_timeout(300)
        assert tab.js("bode.curves.reference === undefined && page.up")
        tab.page.keyboard.press("f")
        tab.until("bode.curves.reference?.frame.columns === 6")
        assert tab.wrong == []


def test_a_pause_goes_into_the_run_that_begins(browser: Browser, tmp_path: Path) -> None:
    with page_of_a_run(browser, tmp_path) as (hub, tab):
        tab.page.keyboard.press(" ")
        tab.until("timeline.atS !== null && !page.seeking")
        begin(hub, tmp_path, Lines(LINES.bins[:6], LINES.window, RATE_HZ), from_s=347.0)
        tab.until("timeline.span.first_s > 346 && bode.curves.measured?.frame.timeS[0] > 346 && !page.seeking")
        assert tab.js("timeline.atS === timeline.span.first_s")
        assert tab.page.locator("#time-now").inner_text() == f"shown: {tab.page.locator('#time-from').inner_text()}"
        assert tab.wrong == []


def test_the_largest_sensitivity_is_not_shown_of_another_moment(browser: Browser, watched: Watched) -> None:
    with Tab(browser, watched.url) as tab:
        row = tab.page.locator("#pane-margins [data-name=at_lines]")
        tab.page.keyboard.press("g")
        row.wait_for()
        tab.page.keyboard.press(" ")
        row.wait_for(state="detached")
        tab.page.keyboard.press(" ")
        row.wait_for()
        assert tab.wrong == []


def test_a_measured_point_near_zero_stays_in_its_scale(browser: Browser, tmp_path: Path) -> None:
    """Its band reaches to zero, which must not squeeze the other points to a stripe."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    hub = dashboard.hub("axis")
    begin(hub, tmp_path, LINES)
    rows = made(1, LINES, hole=0.0, unit="")
    size = np.where(np.arange(len(LINES)) == 4, 1e-3, 1.0)[np.newaxis]
    hub(replace(rows, value=size.astype(complex), sigma=np.full(size.shape, 2e-3), time_s=rows.time_s + 9))
    with dashboard, Tab(browser, dashboard.url) as tab:
        tab.until("bode.curves.measured.frame.timeS[0] > 9 && bode.drawn.measured?.db[bode.at[4]] < -59")
        low, high = tab.js("[bode.charts[0].scales.y.min, bode.charts[0].scales.y.max]")
        assert -120 < low < -60
        assert 0 < high < 60
        assert tab.wrong == []


def test_a_map_of_nothing_valid_has_no_scale(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        rows = "{ rows: 1, columns: 13, timeS: [347.9], schedule: [NaN], magnitude: Array(13).fill(NaN) }"
        tab.until("map.cells !== null")  # the page's own map is drawn
        assert tab.js(f"(map.draw({rows}, 347, 349), map.cells)") is None
        # At standstill the position is noise: the map is over time.
        for reach, moves in ((1e-4, "false"), (0.1, "true")):
            places = [0.9 + reach * (i % 7) / 7 for i in range(40)]
            at = f"timeS: {list(range(40))}, schedule: {places}"
            rows = f"{{ rows: 40, columns: 13, {at}, magnitude: Array(520).fill(0) }}"
            assert tab.js(f"String((map.draw({rows}, 0, 40), map.cells.moving))") == moves
            assert tab.js("String(map.cells.moved)") == moves
        assert tab.wrong == []


def test_every_key_does_what_the_help_lists(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        page = tab.page
        tab.until("bode.curves.model")
        tab.js("bode.go(20)")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowLeft")
        tab.until("document.querySelector('#readout th').textContent === '30 Hz'")
        row = page.locator("#readout [data-name=measured]").inner_text().replace("−", "-")
        numbers = [float(x) for x in re.findall(r"[-+]\d+\.\d+(?= dB|°)", row)]
        newest = RunRecord.open(whole).responses()
        newest = newest[int(np.flatnonzero(newest.valid.any(axis=1))[-1])]
        assert numbers[0] == pytest.approx(newest.magnitude_db[1], abs=0.006)
        for key, pane in (("p", "parameters"), ("g", "margins"), ("m", "map")):
            page.keyboard.press(key)
            assert page.locator(f"#pane-{pane}").is_visible()
        dark = tab.js("document.documentElement.dataset.theme")
        page.keyboard.press("t")
        assert tab.js("document.documentElement.dataset.theme") != dark
        page.keyboard.press("?")
        assert page.locator("#keys").is_visible()
        for key in ("Space", "F", "?", "T", "D", "0"):
            assert page.locator("#keys kbd", has_text=key).first.is_visible()
        page.keyboard.press("Escape")
        page.keyboard.press("d")
        assert page.locator("#download-menu button").first.is_visible()
        page.keyboard.press("Escape")
        assert not page.locator("#download-menu").is_visible()
        page.keyboard.press("a")
        assert page.locator("#events-view [data-value=alarms]").get_attribute("aria-checked") == "true"
        page.locator("#events-view [data-value=all]").focus()
        page.keyboard.press("Space")
        assert tab.js("timeline.atS") is None
        # Everything can be reached by Tab, shows that it has the focus, and has a name.
        names = set()
        for _ in range(60):
            page.keyboard.press("Tab")
            name, outline = page.evaluate(
                "() => { const e = document.activeElement; return [e.getAttribute('aria-label') || e.innerText || "
                "e.labels?.[0]?.innerText || e.title, getComputedStyle(e).outlineStyle]; }"
            )
            if page.evaluate("() => document.activeElement === document.body"):
                continue
            assert name, page.evaluate("() => document.activeElement.outerHTML")
            assert outline != "none", name
            names.add(name.strip())
        assert {"plant G", "Freeze", "Download", "Play", "Map"} <= names
        assert tab.wrong == []


def test_zooming_with_the_mouse_and_back(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        box = tab.page.locator("#magnitude .u-over").bounding_box()
        assert box
        f = [tab.js(f"bode.charts[0].posToVal({share} * {box['width']}, 'x')") for share in (0.3, 0.6)]
        tab.page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 40)
        tab.page.mouse.down()
        tab.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 40, steps=4)
        tab.page.mouse.up()
        for i in range(3):
            scale = tab.js(f"[bode.charts[{i}].scales.x.min, bode.charts[{i}].scales.x.max]")
            assert scale == pytest.approx(f, rel=0.02)
        tab.page.keyboard.press("0")
        assert tab.js("bode.charts[1].scales.x.max") > 140
        assert tab.wrong == []


def test_the_page_is_usable_by_touch_on_a_tablet(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url, viewport=TABLET, has_touch=True, is_mobile=True) as tab:
        box = tab.page.locator("#magnitude .u-over").bounding_box()
        assert box
        x = tab.js("bode.charts[0].valToPos(100, 'x')")
        tab.page.touchscreen.tap(box["x"] + x, box["y"] + box["height"] / 2)
        tab.until("document.querySelector('#readout th').textContent === '100 Hz'")
        before = tab.js("bode.sight")
        cdp = tab.context.new_cdp_session(tab.page)

        def finger(kind: str, share: float) -> None:
            at = {"x": box["x"] + share * box["width"], "y": box["y"] + 60}
            cdp.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [] if kind == "touchEnd" else [at]})

        finger("touchStart", 0.3)
        for share in (0.4, 0.5, 0.6):
            finger("touchMove", share)
        expected = [tab.js(f"bode.charts[0].posToVal({share} * {box['width']}, 'x')") for share in (0.3, 0.6)]
        finger("touchEnd", 0.6)
        tab.until("bode.sight !== bode.whole")
        assert tab.js("bode.sight") == pytest.approx(expected, rel=0.03)
        for _ in range(2):
            tab.page.touchscreen.tap(box["x"] + x, box["y"] + 40)
        tab.until("bode.sight === bode.whole")
        assert tab.js("bode.sight") == before
        for kind, xs in (("touchStart", [120]), ("touchStart", [120, 200]), ("touchMove", [80, 240]), ("touchEnd", [])):
            points = [{"x": box["x"] + x, "y": box["y"] + 60, "id": i} for i, x in enumerate(xs)]
            cdp.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        tab.until("bode.sight !== bode.whole")
        low, high = tab.js("bode.sight")
        assert before[0] < low < high < before[1], "two fingers that part show less"
        tab.page.locator("#tracking").scroll_into_view_if_needed()
        tab.until("tracking.made.data[0].length > 20")
        box = tab.page.locator("#tracking .u-over").bounding_box()
        assert box
        tab.page.touchscreen.tap(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        tab.until("timeline.atS !== null")
        assert tab.js("timeline.atS") == pytest.approx(tab.js("(tracking.fromS + tracking.toS) / 2"), abs=0.1)
        # Nothing is wider than the screen, and what a finger presses is as large as a finger.
        assert tab.js("document.documentElement.scrollWidth") <= TABLET["width"]
        sizes = tab.js(
            "[...document.querySelectorAll('.top button')].filter((b) => b.offsetParent).map((b) => b.offsetHeight)"
        )
        assert min(sizes) >= 40
        assert tab.wrong == []


def test_downloads_hold_the_data(browser: Browser, whole: Path, tmp_path: Path) -> None:
    run = RunRecord.open(whole).responses()
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)

    def get(tab: Tab, words: str) -> Path:
        tab.page.locator("#download").click()
        with tab.page.expect_download() as waiting:
            tab.page.locator("#download-menu button", has_text=re.compile(f"^{re.escape(words)}$")).click()
        path = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(path)
        return path

    with dashboard, Tab(browser, dashboard.url, accept_downloads=True) as tab:
        tab.page.locator("#tracking-span [data-value=whole]").click()
        tab.until("page.past && tracking.toS > 2.9")
        newest = run[int(np.flatnonzero(run.valid.any(axis=1))[-1])]
        rows = list(csv.DictReader(io.StringIO(get(tab, "this response as CSV").read_text())))
        assert [float(r["re [rad/s/(N m)]"]) for r in rows] == newest.value.real.tolist()
        assert [float(r["sigma [rad/s/(N m)]"]) for r in rows] == newest.sigma.tolist()
        mat = loadmat(get(tab, "all responses in the time span as .mat"), simplify_cells=True)["livebode"]
        within = (run.time_s >= tab.js("tracking.fromS")) & (run.time_s <= tab.js("tracking.toS"))
        assert np.array_equal(mat["H"].squeeze().T, run.value[within], equal_nan=True)
        assert mat["time_s"].tolist() == run.time_s[within].tolist()
        tab.page.keyboard.press("3")
        tab.until("bode.curves.measured?.frame.quantity === 'closed loop'")
        rows = list(csv.DictReader(io.StringIO(get(tab, "this response as CSV").read_text())))
        found = np.array([float(r["magnitude [dB]"]) for r in rows])
        assert np.allclose(found, tab.numbers("bode.curves.measured.frame.magnitude"), atol=2e-5)
        assert tab.wrong == []


def test_acknowledging_is_recorded(browser: Browser, watched: Watched) -> None:
    watched.go(6400)
    with Tab(browser, watched.url) as tab:
        page = tab.page
        event = next(e for e in watched.record().events() if e.kind == "non-finite")
        until(lambda: page.locator("#events [role=row]", has_text=event.message).count() == 1, "the event on the page")
        alarm = Event("change", 6000, 1.5, "the belt's <b>stiffness</b> is 9 % less", {"share": -0.09})
        watched.hub(alarm)
        button = page.get_by_role("button", name="Acknowledge: the belt's <b>stiffness</b>")
        button.wait_for()
        assert page.locator("#alarm-count").inner_text() == "⚠ 1 alarm"
        assert page.locator("#events b").count() == 0, "what comes from a machine is text, not HTML"
        button.focus()
        page.keyboard.press("Enter")
        page.get_by_label("Your name").fill("Ann")
        page.keyboard.press("Enter")
        watched.go(8000)
        page.locator("#events [role=row].seen").wait_for()
        assert not page.locator("#alarm-count").is_visible()
        watched.go(10_000)
        found = [e for e in watched.record().events() if e.kind == "acknowledged"]
        assert len(found) == 1
        assert found[0].details["kind"] == "change"
        assert found[0].details["time_s"] == 1.5
        assert "9 % less" in found[0].message
        with Tab(browser, watched.url) as second:
            second.page.locator("#events [role=row].seen").wait_for()
        assert tab.wrong == []


def test_a_finished_run_is_only_looked_at(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        assert tab.page.locator("#status-text").inner_text() == "run · recorded"
        assert tab.page.locator("#events button").count() == 0
        answer = tab.page.evaluate(
            "async () => { const r = await fetch('/api/acknowledge', { method: 'POST', headers: "
            "{ 'content-type': 'application/json' }, body: JSON.stringify({ axis: 0, event: 'x' }) }); "
            "return [r.status, (await r.json()).error]; }"
        )
        assert answer[0] == 400


@contextlib.contextmanager
def two_axes(browser: Browser, whole: Path, without_loop: Path) -> Iterator[Tab]:
    """A page of two finished runs, of which the second does not describe its loop."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    dashboard.view(without_loop)
    with dashboard, Tab(browser, dashboard.url) as tab:
        yield tab


def test_an_axis_without_a_loop_shows_the_plant_beside_other_axes(
    browser: Browser, whole: Path, without_loop: Path
) -> None:
    with two_axes(browser, whole, without_loop) as tab:
        assert tab.page.locator("#axis option").all_inner_texts() == ["run", "other"]
        tab.page.keyboard.press("4")
        tab.until("page.quantity === 'sensitivity' && bode.curves.measured")
        tab.page.locator("#axis").select_option("1")
        tab.until("page.facts.name === 'other' && bode.curves.measured?.frame.axis === 1")
        assert tab.js("page.quantity") == "plant"
        assert tab.page.locator("#quantities button").all_inner_texts() == ["plant G"]
        tab.page.locator("#absent", has_text="no L, T, S: why?").click()
        tab.page.locator("#notice", has_text="configuration contains no controllers").wait_for()
        tab.page.keyboard.press("4")
        tab.page.locator("#notice", has_text="configuration contains no controllers").wait_for()
        assert tab.js("page.quantity") == "plant"
        tab.page.locator("#tab-margins").click()
        tab.page.locator("#pane-margins", has_text="describe its controllers").wait_for()
        assert tab.wrong == []


def test_back_returns_to_the_axis_quantity_and_plot_before_and_a_zoom_is_no_entry(
    browser: Browser, whole: Path, without_loop: Path
) -> None:
    with two_axes(browser, whole, without_loop) as tab:
        page, entries = tab.page, "history.length"
        first = tab.js(entries)
        page.keyboard.press("4")
        tab.until("bode.curves.measured?.frame.quantity === 'sensitivity'")
        page.locator("#bode-kind [data-value=nyquist]").click()
        page.locator("#tracking-what [data-value=phase]").click()  # replaces the address
        page.locator("#axis").select_option("1")
        tab.until("page.facts.name === 'other' && bode.curves.measured?.frame.axis === 1")
        assert tab.js(entries) == first + 3
        for plot in ("nyquist", None):
            page.go_back()
            shown = "page.facts?.name === 'run' && page.quantity === 'sensitivity'"
            tab.until(f"window.livebode?.bode.curves.measured && {shown}")
            assert tab.js("bode.plane?.kind ?? null") == plot


def test_a_late_answer_to_an_earlier_request_does_not_change_the_chosen_axis(
    browser: Browser, whole: Path, without_loop: Path
) -> None:
    with two_axes(browser, whole, without_loop) as tab:
        for key in "42424242":  # another quantity, and in the same moment another axis: the answers cross the wishes
            tab.js(f"document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true }}))")
            tab.page.locator("#axis").select_option("1")
            tab.until("page.facts.name === 'other' && bode.curves.measured?.frame.axis === 1")
            tab.js("new Promise((done) => setTimeout(done, 200))")  # a stray message would be answered by now
            assert tab.js("[page.axis, page.facts.name]") == [1, "other"]
            tab.page.locator("#axis").select_option("0")
            tab.until("page.facts.name === 'run' && bode.curves.measured?.frame.axis === 0")


CONTRAST = """() => {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (c) => { canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = c; canvas.fillRect(0, 0, 1, 1);
    return Array.from(canvas.getImageData(0, 0, 1, 1).data); };
  const part = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = ([r, g, b]) => 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  const found = [];
  for (const e of document.querySelectorAll("body *")) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.checkVisibility() || e.closest("dialog:not([open])")) continue;
    let under = e, ground = [0, 0, 0, 0];
    while (under && (ground = rgba(getComputedStyle(under).backgroundColor))[3] < 250) under = under.parentElement;
    const a = light(rgba(getComputedStyle(e).color)), b = light(ground);
    found.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.textContent.trim().slice(0, 40)]);
  }
  return found;
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_and_curves_have_the_contrast_of_wcag_2(browser: Browser, watched: Watched, scheme: str) -> None:
    """WCAG 2's contrast, 4.5 for text and 3 for curves; light or dark is what the system says."""
    with Tab(browser, watched.url, color_scheme=scheme) as tab:
        assert tab.js("document.documentElement.dataset.theme") == scheme
        tab.page.keyboard.press("f")
        for pane in ("parameters", "margins", "map"):
            tab.page.locator(f"#tab-{pane}").click()
            tab.page.wait_for_timeout(300)
            found = tab.page.evaluate(CONTRAST)
            assert len(found) > 40
            assert min(found)[0] >= 4.5, min(found)
        names = ["measured", "reference", "baseline", "model", *(f"t{i}" for i in range(10))]
        style = "getComputedStyle(document.documentElement)"
        words = json.dumps([*names, "paper"])
        colours = tab.js(f"{words}.map((n) => {style}.getPropertyValue('--' + n).trim())")
        *curves, paper = [luminance(c) for c in colours]
        for name, light in zip(names, curves):
            assert (max(light, paper) + 0.05) / (min(light, paper) + 0.05) >= 3, name
        assert tab.wrong == []


def luminance(colour: str) -> float:
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_lines_of_a_hundred_are_chosen(browser: Browser, whole: Path) -> None:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(whole)
    with dashboard, Tab(browser, dashboard.url) as tab:
        assert tab.page.locator("#tracking-lines button").count() == len(LINES)
        shown = tab.js("tracking.chosen")
        tab.page.locator(f"#tracking-lines [data-line='{shown[0]}']").click()
        tab.page.locator("#tracking-lines [data-line='1']").click()
        assert tab.js("tracking.chosen") == [*shown[1:], 1]
        assert tab.js("tracking.made.series.length") == 1 + 3 * len(shown)
