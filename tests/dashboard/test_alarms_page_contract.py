"""The alarms on the page: one tab stop, the keyboard, the moment of an alarm, shelving, history, and the wall mode."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from livebode.core import Event
from livebode.dashboard.recent import EVERY_S
from tests.support.browser import Tab, chromium
from tests.support.dashboards import LINES, Watched

HOSTILE = "the belt's <b>stiffness</b> is 2.0 ± 0.2 % less"
CHANGE = Event(
    "change", 6000, 1.6, HOSTILE, {"what": "stiffness", "amount_percent": -2.0, "since_s": 1.3, "place_m": None}
)
# 16 minutes of arc at 3 m are 14 mm: 50 px where 1,920 px are 531 mm (24 inches).
LETTER_PX = np.tan(np.radians(16 / 60)) * 3000 / (531 / 1920)
SPEED = 0.6 * 2 * np.pi / 2  # of the simulated axis, at most
ROW = "#events [role=row][data-cause='change: stiffness']"


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with Watched(tmp_path_factory.mktemp("alarms") / "run") as found:
        found.go(8000)
        yield found


@pytest.fixture(scope="module")
def tab(watched: Watched) -> Iterator[Tab]:
    """The page with an alarm in a flood of 500 others."""
    with chromium() as browser, Tab(browser, watched.url) as found:
        assert watched.hub.control is not None
        for i in range(500):
            watched.hub(Event("roles-doubtful", i, i / 1000, f"doubtful {i}", {"reason": f"cause {i}"}))
        found.until("document.querySelectorAll('#events [role=row]').length === 301")
        watched.hub.control.record(CHANGE)
        watched.go(8200)
        found.page.locator(ROW).wait_for()
        found.page.locator("#verdict", has_text="ALARM").wait_for()
        yield found


def stops(tab: Tab) -> int:
    return int(tab.js("document.querySelectorAll('#events [tabindex=\"0\"], #events button:not([tabindex])').length"))


def test_the_list_is_one_tab_stop_in_a_flood_of_causes(watched: Watched, tab: Tab) -> None:
    tab.until("events.all.size === 500 && document.querySelectorAll('#events [role=row]').length === 301")
    assert stops(tab) == 1
    page = tab.page
    page.locator("#events-filter").focus()
    page.keyboard.press("Tab")
    assert tab.js("document.activeElement.dataset.cause") == "change: stiffness", "the highest priority is first"
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowUp")
    assert tab.js("[...document.querySelectorAll('#events [role=row]')].indexOf(document.activeElement)") == 1
    watched.hub(Event("gap", 1, 0.1, "one more event"))  # the focus stays with its row
    held = tab.js("document.activeElement.dataset.cause")
    tab.until("events.all.has('gap')")
    assert tab.js("document.activeElement.dataset.cause") == held
    assert stops(tab) == 1
    page.keyboard.press("Tab")
    assert not tab.js("document.getElementById('events').contains(document.activeElement)")
    page.locator("#events-filter").fill("doubtful 499")
    tab.until("document.querySelectorAll('#events [role=row]').length === 1")
    page.locator("#events-filter").fill("")
    page.locator("#events-filter").blur()
    assert tab.wrong == []


def test_enter_and_a_click_show_the_curves_at_the_alarm_and_before_it(watched: Watched, tab: Tab) -> None:
    page, window_s = tab.page, LINES.window / LINES.rate_hz
    run = watched.record().responses()
    for act in ("Enter", "click"):
        if act == "Enter":
            page.keyboard.press("a")
            page.keyboard.press("Home")
            page.keyboard.press("Enter")
        else:
            page.locator(f"{ROW} p").click()
        tab.until("timeline.atS === 1.6 && !page.seeking && bode.curves.reference")
        at, before = tab.js("[bode.curves.measured.frame.timeS[0], bode.curves.reference.frame.timeS[0]]")
        assert abs(at - 1.6) <= 0.011, "within a hop"
        assert before <= 1.3 - window_s, "its window ends before the change"
        usable = run[np.flatnonzero(run.valid.any(axis=1) & (run.time_s <= 1.3 - window_s))]
        here = run.schedule[np.argmin(np.abs(run.time_s - at))]
        place = usable.schedule[np.argmin(np.abs(usable.time_s - before))]
        nearest = np.abs(usable.schedule - here).min()
        assert abs(place - here) <= nearest + SPEED * EVERY_S, "as near to its position as the stored responses allow"
        assert tab.js("tracking.marked") == 1.6
        page.keyboard.press("u")
        page.keyboard.press(" ")
        tab.until("timeline.atS === null && !bode.curves.reference")
    assert tab.wrong == []


def test_keys_acknowledge_and_shelve_with_the_name_of_the_person(tab: Tab) -> None:
    page = tab.page
    sentence = page.locator("#verdict")
    assert sentence.inner_text() == "⚠ ALARM: belt 2.0 % softer since 1.30 s"
    assert page.locator("#events b").count() == 0, "what comes from a machine is text, not HTML"
    page.locator("#events-filter").fill("stiffness")  # an acknowledged alarm comes after those that are not
    page.keyboard.press("Tab")
    page.keyboard.press("k")
    page.get_by_label("Your name").fill("Ann")
    page.keyboard.press("Enter")
    page.locator(ROW, has_text="acknowledged by Ann").wait_for()
    assert sentence.inner_text().startswith("⚠ ALARM"), "it is still active"
    page.locator(ROW).focus()
    page.keyboard.press("s")
    assert page.get_by_label("Your name").input_value() == "Ann"
    page.get_by_label("Reason").fill("new belt <i>ordered</i>")
    page.keyboard.press("Enter")
    page.locator(ROW, has_text="shelved by Ann until").wait_for()
    tab.until("document.getElementById('verdict').textContent.startsWith('◆ Check: ')")
    page.locator(ROW).focus()
    page.keyboard.press("s")
    page.locator(f"{ROW} .state", has_text="acknowledged, active").wait_for()
    page.locator("#events-view [data-value=history]").click()
    rows = page.locator("#events [role=row][data-cause='change: stiffness']")
    assert [text.split(" ")[0] for text in rows.locator(".state").all_inner_texts()] == [
        "unshelved",
        "shelved",
        "acknowledged",
        "raised",
    ]
    page.locator("#events-filter").fill("ordered")
    tab.until("document.querySelectorAll('#events [role=row]').length === 1")
    page.locator("#events-filter").fill("")
    page.locator("#events-filter").blur()
    page.locator("#events-view [data-value=all]").click()
    assert tab.wrong == []


def test_a_machine_that_is_not_ready_suppresses_its_alarm_and_is_not_called_healthy(watched: Watched, tab: Tab) -> None:
    page, chip = tab.page, tab.page.locator(f"{ROW} .state")
    page.locator("#events-filter").fill("stiffness")
    page.locator("#events-filter").blur()
    for cause in ("gap", "change: stiffness"):
        watched.hub(Event("acknowledged", 8200, 2.0, "acknowledged", {"cause": cause, "by": "Ann", "count": 1}))
    shelf = {"cause": "source", "by": "Ann", "reason": "its silence is not the subject", "until_s": time.time() + 3600}
    watched.hub(Event("shelved", 8200, 2.0, "shelved", shelf))
    chip.filter(has_text="acknowledged, active").wait_for()
    watched.hub(Event("suppressed", 8200, 2.05, "'enabled' is 0: the machine is not ready", {"since_s": 2.05}))
    chip.filter(has_text="suppressed: not ready").wait_for()
    page.keyboard.press("w")
    page.locator(".wall-sentence", has_text="Not assessed: not ready since 2.05 s").wait_for()
    page.keyboard.press("Escape")
    assert page.locator("#verdict").inner_text() == "○ Not assessed: not ready since 2.05 s"
    watched.hub(Event("suppression-ended", 8600, 2.15, "the machine is ready again", {}))
    chip.filter(has_text="acknowledged, active").wait_for()
    page.locator("#verdict", has_text="ALARM: belt 2.0 % softer").wait_for()
    page.locator("#events-filter").fill("")
    page.locator("#events-filter").blur()
    assert tab.wrong == []


LETTERS = """() => Object.fromEntries(['.wall-sentence', '.wall-name', '.wall-clock'].map((name) => {
  const style = getComputedStyle(document.querySelector(name)), pen = document.createElement('canvas').getContext('2d');
  pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  return [name, pen.measureText('H').actualBoundingBoxAscent];
}))"""


def test_the_wall_mode_is_read_from_three_metres_and_ends_with_escape(tab: Tab) -> None:
    page = tab.page
    page.set_viewport_size({"width": 1920, "height": 1080})
    page.keyboard.press("w")
    assert "wall=1" in tab.js("location.hash")
    assert all(height >= LETTER_PX for height in page.evaluate(LETTERS).values()), page.evaluate(LETTERS)
    assert page.locator("#wall").is_visible()
    assert page.locator("#magnitude").is_visible()
    assert page.locator("button:visible, input:visible, select:visible").count() == 0, "nothing to operate"
    assert tab.js("document.documentElement.scrollWidth <= 1920 && document.documentElement.scrollHeight <= 1080")
    page.locator(".wall-sentence", has_text="belt 2.0 % softer").wait_for()
    tab.reload()
    tab.until("window.livebode?.wall.on && bode.curves.measured")
    page.keyboard.press("Escape")
    assert not page.locator("#wall").is_visible()
    assert "wall" not in tab.js("location.hash")
    assert tab.wrong == []


TILES = """(count) => {
  const { page, wall } = livebode, kept = page.verdicts;
  const words = ['healthy', 'no-baseline', 'alarms', 'change'], tones = ['ok', 'open', 'check', 'alarm'];
  page.verdicts = Array.from({ length: count }, (_, i) => ({
    name: `axis ${i + 1}`, live: true, tone: tones[i % 4], word: words[i % 4], count: 1, facts: { what: 'machine' },
    message: '', words: '', cause: '', since_s: 1, since_unix_s: null, seconds: null,
  }));
  wall.draw();
  const pen = document.createElement('canvas').getContext('2d');
  const found = [...wall.tiles.querySelectorAll('b, span')].map((part) => {
    const style = getComputedStyle(part);
    pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
    return pen.measureText('H').actualBoundingBoxAscent;
  });
  const tiles = [...wall.tiles.children];
  const answer = [Math.min(...found), tiles.map((tile) => [tile.className, tile.textContent]),
    wall.host.getBoundingClientRect().bottom, Math.max(...tiles.map((tile) => tile.scrollWidth - tile.clientWidth))];
  page.verdicts = kept;
  wall.draw();
  return answer;
}"""


def test_tiles_of_sixteen_axes_have_letters_for_three_metres_and_more_are_counted(tab: Tab) -> None:
    page = tab.page
    page.set_viewport_size({"width": 1920, "height": 1080})
    page.keyboard.press("w")
    letters, tiles, bottom, wide = page.evaluate(TILES, 16)
    assert letters >= LETTER_PX
    assert len(tiles) == 16
    assert (bottom <= 1080, wide <= 0) == (True, True)
    rank = ["alarm", "check", "open", "ok"]
    assert [tone for tone, _ in tiles] == sorted((tone for tone, _ in tiles), key=rank.index), "the worst first"
    letters, tiles, bottom, _ = page.evaluate(TILES, 24)
    assert letters >= LETTER_PX
    assert bottom <= 1080
    assert tiles[-1][1] == f"+{24 - len(tiles) + 1} more"
    assert len(tiles) >= 16
    page.keyboard.press("Escape")
    size = page.evaluate(LETTERS.replace("'.wall-sentence', '.wall-name', '.wall-clock'", "'.first-look'"))
    assert size[".first-look"] >= LETTER_PX, "also without the wall mode"
