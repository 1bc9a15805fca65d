"""The page of a fleet of 10,000 axes as a person uses it, compared with what the workers report."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from livebode_plant.page.fleet_board import LOOKS
from livebode_plant.page.floor_plan import sanitised
from tests.support.axe import SIZES, violations, with_axe
from tests.support.browser import Tab
from tests.support.fleet_pages import DrivenFeed, expected_looks, fleet_page
from tests.support.languages import pseudo, untranslated

PHONE = {"width": 390, "height": 844}
AXES = 10_000
PLAN = sanitised(
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 120"><text x="10" y="15" font-size="8">Hall</text>'
    '<rect id="Augsburg/body/gantry 1" x="10" y="20" width="80" height="40"/>'
    '<rect data-axis="Augsburg/body/gantry 1/z" x="110" y="20" width="80" height="40"/>'
    '<g transform="translate(0 50)"><rect data-axis="Brno" x="10" y="20" width="80" height="40"/></g></svg>'
)


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[str, DrivenFeed]]:
    with fleet_page(AXES, plan=PLAN) as found:
        yield found


def order(feed: DrivenFeed, tab: Tab) -> list[int]:
    """Number in the fleet of each axis of the page."""
    place = {path: i for i, path in enumerate(feed.fleet.paths)}
    return [place[path] for path in tab.js("feed.paths")]


def ready(tab: Tab, axes: int = AXES) -> Page:
    tab.until(f"feed.looks.length === {axes} && feed.frames > 0 && tiles.shown.length")
    return tab.page


def test_every_tile_shows_the_state_of_its_axis(browser: Browser, served: tuple[str, DrivenFeed]) -> None:
    url, feed = served
    with Tab(browser, url, wait=False) as tab:
        page = ready(tab)
        at = order(feed, tab)
        truth = np.array(expected_looks(feed.status))[at]
        tab.until(f"feed.looks.reduce((n, v) => n + v, 0) === {int(truth.sum())}")
        assert tab.numbers("feed.looks").tolist() == truth.tolist()
        for look in ("alarm", "check", "silent"):
            count = np.count_nonzero(truth == LOOKS.index(look))
            chip = page.locator(f"#looks [data-look='{look}'] b")
            chip.filter(has_text=f"{count}").wait_for()
        page.locator("#looks [data-look='silent']").click()
        assert tab.numbers("tiles.shown").tolist() == np.flatnonzero(truth == LOOKS.index("silent")).tolist()
        page.locator("#looks [data-look='silent']").click()
        # What is drawn, in a frame after the click, is what is known: the pixels of two tiles of different looks.
        tab.until(f"{_PIXELS} === 2")
        assert tab.wrong == []


# Of the visible tiles, the number of different pictures, of one that is OK and one that is not.
_PIXELS = """(() => {
  const visible = [...tiles.shown].slice(0, 300), ok = visible.findIndex((a) => feed.looks[a] === 1),
    other = visible.findIndex((a) => feed.looks[a] > 1), side = tiles.size.height, { width, height } = tiles.canvas;
  // Of a copy, in memory: Chromium complains if what is drawn for the screen is read back again and again.
  const copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  copy.drawImage(tiles.canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, width, height);
  const picture = (place) => {
    const { x, y } = tiles.box(place), rows = [];
    for (let row = y; row < y + side; row++) rows.push(data.slice(4 * (row * width + x), 4 * (row * width + x + side)));
    return rows.join();
  };
  return new Set([ok, other].map(picture)).size;
})()"""


def test_an_alarm_appears_is_acknowledged_and_shelved(browser: Browser) -> None:
    with fleet_page(60, after_s=0.5) as (url, feed), Tab(browser, url + "#list=alarms", wait=False) as tab:
        page = ready(tab, 60)
        path = feed.fleet.paths[7]
        feed.raise_alarm(7)
        row = page.locator(f"#events [data-row='{path}']")
        row.wait_for()
        assert "not acknowledged · high priority" in row.inner_text()
        page.locator("#heard").filter(has_text="not acknowledged").wait_for(state="attached")
        at = tab.js("feed.paths").index(path)
        assert tab.js(f"feed.looks[{at}]") == LOOKS.index("alarm")
        row.focus()
        page.keyboard.press("k")
        page.locator("dialog.person input").first.fill("Ann")
        page.keyboard.press("Enter")
        row.locator(".state.acknowledged").wait_for()
        assert "Ann" in row.inner_text()
        tab.until(f"feed.looks[{at}] === {LOOKS.index('acknowledged')}")
        row.focus()
        page.keyboard.press("s")
        page.keyboard.type("spare part")
        page.keyboard.press("Enter")
        row.locator(".state.shelved").wait_for()
        assert "spare part" in row.inner_text()
        row.locator(".acts button").last.click()
        row.locator(".state.acknowledged").wait_for()
        feed.raise_alarm(7)
        row.locator(".state.unacknowledged").wait_for()
        assert tab.wrong == []


def test_dead_workers_gaps_and_lost_axes_are_shown(browser: Browser) -> None:
    with fleet_page(600) as (url, feed), Tab(browser, url + "#list=workers", wait=False) as tab:
        page = ready(tab, 600)
        page.locator("#events [data-row='worker-1']").wait_for()
        feed.dead.add(1)
        page.locator("#events [data-row='partition 1']").wait_for()
        assert "1 partition without worker" in page.locator("#summary").inner_text()
        assert tab.js(f"feed.looks.filter((l) => l === {LOOKS.index('lost')}).length") == 250
        page.locator("#lists [data-value=gaps]").click()
        lost = int(feed.status["lost"].sum())
        page.locator("#summary").filter(has_text=f"{lost:,}".replace(",", "\u202f")).wait_for()
        assert tab.wrong == []


def test_the_keyboard_reaches_everything_and_the_address_keeps_it(
    browser: Browser, served: tuple[str, DrivenFeed]
) -> None:
    url, feed = served
    with Tab(browser, url, wait=False) as tab:
        page = ready(tab)
        page.locator("#nodes button").nth(1).focus()
        page.keyboard.press("Enter")
        tab.until("places.path === 'Brno'")
        page.locator("#nodes button").first.press("Enter")
        tab.until("places.path.startsWith('Brno/')")
        place = tab.js("places.path")
        page.locator("#tiles").focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowDown")
        columns = tab.js("tiles.plan.columns")
        group = tab.js("tiles.plan.groups[0].to")
        assert tab.js("tiles.at") == (1 + columns if 1 + columns < group else group + min(1, columns - 1))
        axis = tab.js("feed.paths[tiles.shown[tiles.at]]")
        told = page.locator("#tiles [role=option]")
        assert (told.text_content() or "").startswith(f"{axis}: ")
        assert told.get_attribute("id") == page.locator("#tiles").get_attribute("aria-activedescendant")
        page.keyboard.press("End")
        assert tab.js("tiles.at === tiles.shown.length - 1 && tiles.host.scrollTop > 0")
        page.keyboard.press("Home")
        page.keyboard.press("Enter")
        assert page.locator("#axis-title").inner_text() == tab.js("feed.paths[tiles.shown[0]]")
        page.locator("#axis-facts dd").first.wait_for()
        page.reload()
        ready(tab)
        page.locator("dialog#axis[open] #axis-facts dd").first.wait_for()
        assert tab.js("places.path") == place
        page.keyboard.press("Escape")
        page.keyboard.press("/")
        page.keyboard.type("gantry 3/z")
        sought = [path for path in feed.fleet.paths if "gantry" in path and "3/z" in path]
        tab.until(f"tiles.shown.length === {sum(path.startswith(f'{place}/') for path in sought)}")
        assert tab.js("document.activeElement.id") == "search"
        page.locator("#crumbs button").first.click()
        assert tab.js("tiles.shown.length") == len(sought)
        assert tab.wrong == []


def test_the_floor_plan_shows_machines_and_leads_to_them(browser: Browser, served: tuple[str, DrivenFeed]) -> None:
    url, _ = served
    with Tab(browser, url + "#view=plan", wait=False) as tab:
        tab.until("plan.parts?.length === 3")
        page, order_ = tab.page, [2, 3, 10, 8, 4, 5, 9, 7, 6, 0, 1]
        urgent = [3, *[n for n in order_ if n != 3]]
        looks = dict(zip(tab.js("feed.paths"), tab.numbers("feed.looks").astype(int)))
        for path, label in (
            (part, page.locator(f"[aria-label^='{part}:']")) for part in ("Brno", "Augsburg/body/gantry 1/z")
        ):
            inside = [n for axis, n in looks.items() if axis == path or axis.startswith(f"{path}/")]
            worst = min(inside, key=urgent.index)
            assert f"plan-{LOOKS[worst].replace(' ', '-')}" in (label.get_attribute("class") or ""), path
        page.locator("[aria-label^='Augsburg/body/gantry 1/z:']").click()
        assert page.locator("#axis-title").inner_text() == "Augsburg/body/gantry 1/z"
        page.keyboard.press("Escape")
        page.locator("#plan [tabindex='0']").focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Enter")
        tab.until("places.path === 'Brno' && tiles.shown.length")
        assert tab.wrong == []


def test_axe_finds_nothing_in_light_dark_and_on_a_phone(browser: Browser, served: tuple[str, DrivenFeed]) -> None:
    url, _ = served
    found = []
    with with_axe(browser) as tab:
        page = tab.page
        page.set_viewport_size({"width": 1440, "height": 900})
        page.goto(url + "#list=alarms&view=plan")
        tab.until("plan.parts?.length")
        page.locator("#events .state").first.wait_for()
        found += violations(tab, "fleet plan")
        page.locator("#views [data-value=tiles]").click()
        found += violations(tab, "fleet")
        page.locator("#theme").click()
        page.set_viewport_size(PHONE)  # type: ignore[arg-type]
        found += violations(tab, "fleet", only=SIZES)
        assert tab.js("document.documentElement.scrollWidth") <= PHONE["width"]
        page.locator("#events [data-row]").first.click()
        page.locator("dialog#axis[open] #axis-facts dd").first.wait_for()
        found += violations(tab, "axis of a fleet", only=SIZES)
        assert tab.wrong == []
    assert not found, "\n".join(found)


def test_the_page_has_no_english_outside_of_its_catalogue(browser: Browser, served: tuple[str, DrivenFeed]) -> None:
    url, feed = served
    answer = json.dumps(asdict(pseudo()) | {"languages": {"en": "English"}})
    data = {"livebode", "plant", "worker", "Hall", "stiffness"}
    data |= {word for path in feed.fleet.paths for part in path.split("/") for word in part.split()}
    with Tab(browser, "about:blank", wait=False) as tab:
        tab.page.route("**/catalogue*", lambda route: route.fulfill(body=answer, content_type="application/json"))
        tab.page.goto(url)
        ready(tab)
        for name in ("worst", "alarms", "workers", "gaps"):
            tab.page.locator(f"#lists [data-value={name}]").click()
            tab.until(f"lists.news.{name} && lists.list === '{name}'")
            assert untranslated(tab.page.evaluate(_TEXTS), data) == set(), name
        tab.page.locator("#events [data-row]").first.click()
        tab.page.locator("dialog#axis[open] #axis-facts dd").first.wait_for()
        assert untranslated(tab.page.evaluate(_TEXTS), data) == set()


_TEXTS = r"""() => {
  const found = [...document.querySelectorAll("*")].flatMap((e) => [e.title, e.ariaLabel, e.placeholder]);
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) found.push(walker.currentNode.data);
  return found.join("\n");
}"""
