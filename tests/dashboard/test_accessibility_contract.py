"""The pages used without a mouse, without colours, with a screen reader, on a telephone: axe-core, keys, sizes."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from livebode.core import Event
from livebode.dashboard import Dashboard, ServerSettings
from livebode_reports.html import to_html
from livebode_reports.report_data import read
from livebode_reports.run_report import report_of
from tests.support.axe import SIZES, violations, with_axe
from tests.support.baselines import compared
from tests.support.browser import DESK, Tab
from tests.support.dashboards import Watched
from tests.support.guarded import TOKEN, guarded
from tests.support.many_runs import source_run, weeks

PHONE = {"width": 390, "height": 844}
CHANGE = Event(
    "change", 6000, 1.6, "the belt's stiffness is 2 % less",
    {"what": "stiffness", "amount_percent": -2.0, "since_s": 1.3, "place_m": None},
)  # fmt: skip


def sides(tab: Tab) -> Iterator[list[str] | None]:
    """The page on a light desk, for all rules; in dark on a telephone, for those that depend on it."""
    tab.page.set_viewport_size(DESK)  # type: ignore[arg-type]
    yield None
    tab.page.locator("#theme").click()
    assert tab.js("document.documentElement.dataset.theme") == "dark"
    tab.page.set_viewport_size(PHONE)  # type: ignore[arg-type]
    for fold in tab.page.locator("button.fold").all():
        fold.click()
    yield SIZES
    tab.page.locator("#theme").click()
    for fold in tab.page.locator("button.fold").all():
        fold.click()
    tab.page.set_viewport_size(DESK)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with guarded(tmp_path_factory.mktemp("guarded")) as found:
        yield found


@pytest.fixture(scope="module")
def tab(browser: Browser, watched: Watched) -> Iterator[Tab]:
    with with_axe(browser) as found:
        found.page.goto(watched.url)
        yield found


def enter(tab: Tab) -> None:
    """Show the page to an operator."""
    tab.page.locator("#token, #bode-kind button").first.wait_for()
    if tab.page.locator("#token").count():
        tab.page.locator("#log-in:enabled").wait_for()
        tab.page.locator("#token").fill(TOKEN)
        tab.page.keyboard.press("Enter")
    tab.until("window.livebode?.bode.curves.measured")


def test_axe_finds_nothing_on_the_login(tab: Tab) -> None:
    tab.page.locator("#token").wait_for()
    found = violations(tab, "login")
    tab.page.emulate_media(color_scheme="dark")
    found += violations(tab, "login", only=SIZES)
    tab.page.emulate_media(color_scheme="light")
    assert not found, "\n".join(found)


HEAR = """() => {
  window.heard = [];
  for (const region of document.querySelectorAll('[aria-live], [role=status], [role=alert]'))
    new MutationObserver(() => heard.push(region.textContent))
      .observe(region, { childList: true, characterData: true, subtree: true });
}"""


def test_what_changes_each_second_is_not_read_out(tab: Tab, watched: Watched) -> None:
    """The seconds of a silent machine go on in the sentence and beside the lamp, in wall mode too."""
    enter(tab)
    page = tab.page
    page.evaluate(HEAR)
    for key, sentence in (("w", ".wall-sentence"), ("Escape", "#verdict")):
        page.keyboard.press(key)
        tab.until(f"/no samples for \\d+\\ss/.test(document.querySelector('{sentence}').textContent)")
        before = page.locator(sentence).inner_text()
        tab.until(f"document.querySelector('{sentence}').textContent !== {before!r}")
        assert page.locator("#verdict-heard").evaluate("(e) => e.checkVisibility()")
    heard = page.evaluate("heard")
    assert len(heard) <= 1, heard
    watched.go(watched.hub.samples + 2000)
    tab.until("!/no samples/.test(document.getElementById('verdict').textContent)")
    after = page.evaluate("heard").count(page.locator("#verdict-heard").text_content())
    assert after == 1, "the change is read out once"


def panels(tab: Tab) -> Iterator[tuple[str, str]]:
    """Parts of the page that a person opens, one after the other."""
    page = tab.page
    for key, name in (("p", "parameters"), ("g", "margins")):
        page.keyboard.press(key)
        yield name, ".more"
    page.locator("#what-if").click()
    page.locator("#what-if-margins tbody").wait_for()
    page.get_by_role("button", name="add a notch").click()
    yield "what if", "#what-if-card"
    page.locator("#what-if-reset").click()
    page.keyboard.press("Escape")
    for panel in ("bode-view", "bode-curves"):
        page.locator(f"#{panel}").click()
        yield panel, f"#{panel}-panel"
        page.keyboard.press("Escape")
    page.keyboard.press("d")
    yield "download", ".top"
    page.keyboard.press("Enter")
    for key, dialog in (("", "export"), ("?", "keys"), ("r", "table"), ("s", "shelve")):
        if key == "s":
            page.locator("#events [role=row].alarm").focus()
        if key:
            page.keyboard.press(key)
        page.locator("dialog[open]").wait_for()
        yield dialog, "dialog[open]"
        page.keyboard.press("Escape")


def states(tab: Tab) -> Iterator[tuple[str, str]]:
    """The page in its states, and what of it differs there."""
    page = tab.page
    page.evaluate("() => document.activeElement.blur()")
    yield "live with an alarm", "html"
    page.keyboard.press(" ")
    tab.until("timeline.atS !== null && !page.seeking")
    yield "paused", ".top, .timeline"
    page.keyboard.press(" ")
    page.locator("#bode-kind [data-value=nyquist]").click()
    yield "Nyquist", ".bode"
    page.locator("#bode-kind [data-value=bode]").click()
    page.keyboard.press("w")
    yield "wall", "html"
    page.keyboard.press("Escape")


def test_axe_finds_nothing_on_the_live_page(tab: Tab, watched: Watched) -> None:
    enter(tab)
    watched.hub(CHANGE)
    tab.page.locator("#events [role=row].alarm").wait_for()
    tab.page.locator("#verdict.alarm").wait_for()
    tab.page.keyboard.press("f")
    tab.until("bode.curves.reference")
    found = []
    for only in sides(tab):
        for what, within in states(tab):
            found += violations(tab, what, within, only)
        if only:  # what is in panels has the same rules on both: in dark and on a telephone it is least likely to fit
            for what, within in panels(tab):
                found += violations(tab, what, within)
    assert not found, "\n".join(found)


AT_START = """() => { const e = document.createElement('i'); e.tabIndex = -1;
  document.body.prepend(e); e.focus(); e.remove(); }"""
FOCUS = """() => { const e = document.activeElement, s = getComputedStyle(e);
  return [e.id || e.dataset.value || e.dataset.name || e.dataset.line || e.textContent, s.outlineStyle]; }"""
# A radio group, a list of tabs and the list of alarms are one stop: arrows move within it.
REACHED = """() => [...document.querySelectorAll('a[href], button, select, input, [tabindex="0"]')].filter((e) =>
  e.checkVisibility() && !e.disabled && e.tabIndex >= 0).length"""


def test_everything_is_reached_by_tab_and_what_the_mouse_does_on_plots_has_keys(tab: Tab) -> None:
    enter(tab)
    page = tab.page
    page.keyboard.press("m")
    tab.until("map.cells && tracking.made.data[0].length > 20")
    page.evaluate(AT_START)
    stops: list[str] = []
    while len(stops) < 200:
        page.keyboard.press("Tab")
        if page.evaluate("() => document.activeElement === document.body"):
            break
        name, outline = page.evaluate(FOCUS)
        assert outline != "none", name
        stops.append(name)
    assert len(stops) == page.evaluate(REACHED), stops
    assert {"magnitude", "phase", "coherence", "tracking", "map", "time", "help"} <= set(stops)

    for opener, dialog in (("help", "keys"), ("bode-table", "table")):
        page.locator(f"#{opener}").focus()
        page.keyboard.press("Enter")
        page.locator(f"#{dialog}").wait_for()
        page.keyboard.press("Escape")
        assert tab.js("document.activeElement.id") == opener

    page.locator("#magnitude").focus()
    low, high = tab.js("bode.limits(0)")
    page.keyboard.press("PageUp")
    near = tab.js("bode.limits(0)")
    assert near[1] - near[0] == pytest.approx(0.7 * (high - low))
    page.keyboard.press("ArrowUp")
    assert tab.js("bode.limits(0)") == pytest.approx([v + 0.15 * (near[1] - near[0]) for v in near])
    page.keyboard.press("0")
    page.keyboard.press("+")
    assert tab.js("bode.sight !== bode.whole && bode.zooming.heights[0] === null")
    page.keyboard.press("0")
    page.locator("#map").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    assert "30 Hz" in page.locator("#map-hover").inner_text()
    page.locator("#tracking-lines [data-line='1']").focus()
    chosen = tab.js("tracking.chosen.includes(1)")
    page.keyboard.press("Enter")
    assert tab.js("tracking.chosen.includes(1)") is not chosen
    page.keyboard.press("v")
    page.locator("#plane").focus()
    (x, (low, high)) = tab.js("bode.plane.box")
    page.keyboard.press("ArrowUp")
    assert tab.js("bode.plane.sight") == [x, pytest.approx([v + 0.15 * (high - low) for v in (low, high)])]
    page.keyboard.press("PageUp")
    ((low, high), _) = tab.js("bode.plane.sight")
    assert high - low == pytest.approx(0.7 * (x[1] - x[0]))
    page.keyboard.press("0")
    page.locator("#bode-kind [data-value=bode]").click()


def test_plots_are_described_in_words_and_all_lines_are_a_table(tab: Tab) -> None:
    enter(tab)
    page = tab.page
    page.locator("#quantities button").nth(1).click()
    tab.until("bode.curves.measured?.frame.quantity === 'open loop'")
    for key, charts in (("p", "parameters"), ("g", "marginTrends")):
        page.keyboard.press(key)
        tab.until(f"{charts}.items.size && [...{charts}.items.values()].some((item) => item.made)")
    page.keyboard.press("v")
    tab.until("document.getElementById('plane').getAttribute('aria-label').includes('phase margin')")
    plane = page.locator("#plane").get_attribute("aria-label") or ""
    assert plane.startswith("Nyquist plot, open loop L, 13 lines, 20 Hz to 140 Hz, ")
    chart = page.locator("#pane-parameters .trend[data-name=resonance] .plot")
    value = tab.js("parameters.items.get('two-mass\\0resonance').v.at(-1)")
    words = chart.get_attribute("aria-label") or ""
    assert words.startswith(f"resonance, {value:.4g} ± "), words
    assert ", between " in words
    assert "−" not in words, "no time is before the start of the recording"
    margin = page.locator("#margin-trends .trend[data-name=phase_margin] .plot").get_attribute("aria-label") or ""
    assert margin.startswith("phase margin, "), margin
    page.locator("#bode-kind [data-value=bode]").click()
    page.locator("#quantities button").first.click()
    tab.until("bode.curves.measured?.frame.quantity === 'plant'")
    peak = tab.js("bode.valuesAt(4).measured.db")
    tab.until("document.getElementById('magnitude').getAttribute('aria-label').includes('plant G')")
    words = page.locator("#magnitude").get_attribute("aria-label") or ""
    assert words.startswith("Bode plot: magnitude, plant G, 13 lines, 20 Hz to 140 Hz, highest"), words
    assert f"highest +{peak:.2f} dB at 60 Hz" in words
    assert "60 Hz" in (page.locator("#tracking").get_attribute("aria-label") or "")
    page.keyboard.press("r")
    rows = page.locator("#table-values tbody tr")
    assert rows.count() == 13
    assert rows.nth(4).inner_text().startswith(f"60 Hz\t+{peak:.2f} dB")
    page.keyboard.press("Escape")


def test_end_labels_keep_their_order_and_do_not_overlap(tab: Tab) -> None:
    enter(tab)
    spread = "async (places) => (await import('/static/end-labels.js')).spread(places, 0, 60, 10)"
    for places in ([5, 5, 5], [58, 59, 60], [0, 30, 60], [-20, 10, 90], []):
        found = tab.page.evaluate(spread, places)
        assert all(b - a >= 10 for a, b in itertools.pairwise(found))
        assert all(0 <= at <= 60 for at in found)
    assert tab.page.evaluate(spread, [0, 30, 60]) == [0, 30, 60]


SMALL = """(least) => [...document.querySelectorAll('button, select, input, a[href]')].filter((e) => {
  const box = e.getBoundingClientRect();
  return e.checkVisibility() && box.width && (box.height < least || box.width < 24) && e.type !== 'checkbox';
}).map((e) => `${e.outerHTML.slice(0, 90)} ${e.offsetWidth} × ${e.offsetHeight}`)"""
PLOTS = {"magnitude": "bode.sight === bode.whole", "tracking": "page.zoom === null"}


def over(tab: Tab, plot: str) -> dict[str, float]:
    """The place of a plot after it was scrolled into the middle of the screen."""
    place = tab.page.locator(f"#{plot} .u-over")
    place.evaluate("(e) => e.scrollIntoView({ block: 'center', behavior: 'instant' })")
    box = place.bounding_box()
    assert box
    return dict(box)


def wheel(tab: Tab, plot: str) -> None:
    """The wheel over a plot scrolls a page that is longer than the screen; with Ctrl it zooms."""
    box = over(tab, plot)
    tab.page.mouse.move(box["x"] + 80, box["y"] + box["height"] / 2)
    before = tab.js("scrollY")
    tab.page.mouse.wheel(0, -60 if before else 60)
    tab.until(f"scrollY !== {before}")
    assert tab.js(PLOTS[plot]), "the wheel scrolls the page"
    over(tab, plot)
    tab.page.keyboard.down("Control")
    tab.page.mouse.wheel(0, -60)
    tab.page.keyboard.up("Control")
    tab.until(f"!({PLOTS[plot]})")
    tab.js("(bode.reset(), zoom.reset())")


def fingers(tab: Tab, plot: str) -> None:
    """One finger scrolls the page, two fingers zoom."""
    cdp = tab.context.new_cdp_session(tab.page)

    def move(*paths: tuple[tuple[float, float], tuple[float, float]]) -> None:
        for i in range(9):
            share = i / 8
            at = [
                {"x": x0 + share * (x1 - x0), "y": y0 + share * (y1 - y0), "id": k}
                for k, ((x0, y0), (x1, y1)) in enumerate(paths)
            ]
            cdp.send("Input.dispatchTouchEvent", {"type": "touchMove" if i else "touchStart", "touchPoints": at})
        cdp.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    box = over(tab, plot)
    y = box["y"] + box["height"] / 2
    before = tab.js("scrollY")
    move(((150, y), (150, y - 90)))
    tab.until(f"scrollY > {before}")
    assert tab.js(PLOTS[plot]), "a finger that moves up scrolls"
    y = over(tab, plot)["y"] + box["height"] / 2
    move(((150, y), (110, y)), ((220, y), (280, y)))
    tab.until(f"!({PLOTS[plot]})")
    tab.js("(bode.reset(), zoom.reset())")


def test_a_touch_screen_scrolls_over_plots_and_has_room_for_fingers(
    browser: Browser, watched: Watched, tab: Tab
) -> None:
    enter(tab)
    kept = tab.context.storage_state()
    with Tab(browser, watched.url, viewport=PHONE, has_touch=True, is_mobile=True, storage_state=kept) as touch:
        page = touch.page
        touch.until("map.cells")
        for width, height in ((844, 390), (768, 1024), (1280, 800), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            touch.until(f"innerWidth === {width}")
            touch.settle()
            assert touch.js("document.documentElement.scrollWidth") <= width
            assert page.evaluate(SMALL, 44) == []
            assert touch.js("tracking.made.height") > 150, "large buttons leave room for the plot"
        for plot in PLOTS:
            wheel(touch, plot)
            fingers(touch, plot)
        touch.js("wall.show(true)")
        page.touchscreen.tap(200, 400)
        page.locator(".wall-leave").tap()
        assert not touch.js("wall.on")
        assert touch.wrong == []


def test_axe_finds_nothing_on_the_other_pages(browser: Browser, watched: Watched, tmp_path: Path) -> None:
    runs = weeks(source_run(), tmp_path / "runs")
    watched.end()
    compared(watched.directory, runs / "compared")
    document = report_of(read(runs / "day 4"), made=datetime.now(UTC))
    (tmp_path / "report.html").write_text(to_html(document), "utf-8")
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view_all(runs)
    found = []
    with dashboard, with_axe(browser) as tab:
        for path, shown in (
            ("", "[data-run='day 5']"),
            ("trends", "#cards canvas"),
            ("run/compared/", "#legend [data-name=baseline]"),
        ):
            tab.page.goto(f"{dashboard.url}{path}")
            tab.page.locator(shown).first.wait_for()
            for only in sides(tab):
                found += violations(tab, path or "runs", only=only)
        tab.page.goto((tmp_path / "report.html").as_uri())
        found += violations(tab, "report", "h1, h2, p, table", ["color-contrast"])
        tab.page.emulate_media(color_scheme="dark")
        tab.page.set_viewport_size(PHONE)  # type: ignore[arg-type]
        found += violations(tab, "report")
    assert not found, "\n".join(found)
