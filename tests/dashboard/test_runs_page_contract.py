"""All runs and their trends in a browser, as a person uses them: find, tag, compare, delete, see a change."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from livebode.dashboard import Dashboard, ServerSettings
from livebode.interface import write_examples
from livebode.language import in_language
from livebode.records import read_notes
from livebode_reports.compare_report import Comparison
from tests.support.browser import Tab
from tests.support.command import livebode
from tests.support.languages import pseudo, untranslated
from tests.support.many_runs import BEGUN, SOFTER, source_run, weeks
from tools.run_copies import copy_run

PHONE = {"width": 390, "height": 844}
HOSTILE = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return weeks(source_run(), tmp_path_factory.mktemp("weeks"))


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view_all(folder)
    with dashboard:
        yield dashboard.url


def names(page: Page) -> list[str]:
    return [row.get_attribute("data-run") or "" for row in page.locator("#rows tr").all()]


def wait_for(page: Page, *runs: str) -> None:
    """Wait until the list has these rows."""
    script = (
        "(wanted) => JSON.stringify([...document.querySelectorAll('#rows tr')].map((r) => r.dataset.run)) === wanted"
    )
    page.wait_for_function(script, arg=json.dumps(runs, separators=(",", ":")))


def test_a_run_is_found_tagged_compared_opened_and_deleted(browser: Browser, url: str, folder: Path) -> None:
    with Tab(browser, url, wait=False) as tab:
        page, newest_first = tab.page, ["broken", "no clock", *(f"day {i}" for i in range(5, -1, -1))]
        page.locator("[data-run='day 5']").wait_for()
        assert sorted(names(page)) == sorted(newest_first)
        assert [n for n in names(page) if n.startswith("day")] == newest_first[2:]
        page.locator("[data-key='order-size']").click()
        assert page.locator("[aria-sort='descending']").inner_text().startswith("Size")
        page.keyboard.press("/")
        page.keyboard.type("ALARM day")
        wait_for(page, "day 3", "day 4", "day 5")
        page.locator("[data-key='edit-day 4']").click()
        page.keyboard.type(f"belt, after service, {HOSTILE}")
        page.locator("#notes-text").fill(HOSTILE)
        page.keyboard.press("Tab")
        page.locator("#notes .primary").click()
        page.locator("[data-key='tag-day 4-after service']").click()
        wait_for(page, "day 4")
        assert page.locator("#search").input_value() == 'ALARM day #"after service"'
        assert page.locator("[data-run='day 4'] .notes").inner_text() == HOSTILE
        assert read_notes(folder / "day 4").tags == ["belt", "after service", HOSTILE]
        page.reload()  # the search is in the address
        wait_for(page, "day 4")
        page.locator("#search").fill("day")
        page.locator("[data-key='choose-day 4']").check()
        assert page.locator("#compare").get_attribute("aria-disabled") == "true"
        page.locator("[data-key='choose-day 0']").check()
        assert page.locator("#compare").get_attribute("href") == "/compare?before=day+0&after=day+4&language=en"
        page.locator("[data-key='delete-day 1']").click()
        assert "day 1" in page.locator("#deletion-what").inner_text()
        page.keyboard.type("day")
        assert page.locator("#deletion-confirm").is_disabled()
        page.keyboard.type(" 1")
        page.keyboard.press("Enter")
        page.locator("[data-run='day 1']").wait_for(state="detached")
        assert not (folder / "day 1").exists()
        copy_run(folder / "day 0", folder / "day 9", begun=BEGUN - 1)
        page.locator("[data-run='day 9']").wait_for()  # by itself
        assert page.locator("[data-key='open-day 9']").get_attribute("href") == "/run/day%209/"
        shutil.rmtree(folder / "day 9")
        page.locator("[data-run='day 9']").wait_for(state="detached")
        assert tab.wrong == []


def test_the_comparison_is_the_report_of_livebode_compare_without_a_refused_part(
    browser: Browser, url: str, folder: Path
) -> None:
    with in_language("de"):
        sentences = [finding.text for finding in Comparison.of(folder / "day 0", folder / "day 4").sentences]
    with Tab(browser, url + "login", wait=False) as tab:
        answer = tab.page.goto(url + "compare?before=day+0&after=day+4&language=de")
        assert answer is not None
        policy = answer.headers["content-security-policy"]
        assert ("default-src 'none'" in policy, "script" in policy) == (True, False)
        assert answer.headers["x-frame-options"] == "DENY"
        assert tab.page.locator("main > ul.verdict li span:last-child").all_inner_texts() == sentences
        assert tab.page.locator("svg").count() >= 1
        weight = "getComputedStyle(document.querySelector('.verdict .tone')).fontWeight"
        assert tab.page.evaluate(weight) == "700"  # its style is applied
        assert tab.wrong == []


def test_the_name_of_a_recording_is_not_broken_on_a_desk(browser: Browser, url: str) -> None:
    with Tab(browser, url, wait=False, viewport={"width": 1400, "height": 900}) as tab:
        cell = tab.page.locator("[data-run='day 5'] [data-column='machine']")
        cell.wait_for()
        rows = """(cell) => {
          cell.firstChild.data = "gantry-1-today.parquet";
          const range = document.createRange();
          range.selectNodeContents(cell.firstChild);
          return range.getClientRects().length;
        }"""
        assert cell.evaluate(rows) == 1


def test_what_cannot_be_opened_is_a_page_with_the_sentence(browser: Browser, tmp_path: Path) -> None:
    """Output-only runs, unknown ones, and comparisons that are not possible; the list has no estimator of the first."""
    write_examples(["output-only"], tmp_path)
    assert livebode("run", tmp_path / "ambient.toml", "--out", tmp_path / "runs" / "ambient").code == 0
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view_all(tmp_path / "runs")
    with dashboard, Tab(browser, dashboard.url, wait=False) as tab:
        page = tab.page
        page.locator("[data-key='open-ambient']").wait_for()
        assert "joint" not in page.locator("[data-run='ambient']").inner_text()
        for address, said in (
            ("run/ambient/", "output"),
            ("run/%3Ci%3E/", "there is no run '<i>'"),
            ("compare?before=ambient&after=ambient&language=de", ";"),
        ):
            answer = page.goto(dashboard.url + address)
            assert answer is not None
            assert (answer.status, answer.headers["content-type"]) == (400, "text/html; charset=utf-8")
            sentence = page.locator("[role=alert]").inner_text()
            assert said in sentence, sentence
            assert "{" not in sentence
        assert page.locator("html").get_attribute("lang") == "de"
        page.locator("a.back").click()
        page.locator("[data-run='ambient']").wait_for()
        assert [text for text in tab.wrong if "400" not in text] == []


def test_the_trends_show_the_known_change_and_lead_to_the_run(browser: Browser, url: str) -> None:
    with Tab(browser, url + "trends#find=day", wait=False) as tab:
        page = tab.page
        chart = page.locator("[data-name='two-mass/Keff']")
        chart.locator("canvas").wait_for()
        page.wait_for_function("() => document.getElementById('cards').dataset.runs")
        plot, read = chart.locator(".plot"), chart.locator(".read")
        values = {}
        plot.focus()
        for key, name in (("Home", "day 0"), ("End", "day 5"), ("ArrowLeft", "day 4")):
            page.keyboard.press(key)
            text = read.inner_text()
            assert text.startswith(name)
            values[name] = float(text.split(": ", 1)[1].split(" ± ")[0])
        assert abs(values["day 5"] / values["day 0"] - SOFTER) < 0.005
        assert "other.json" in page.locator("#baselines").inner_text()
        box = plot.bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 30)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.95 * box["width"], box["y"] + 30, steps=4)
        page.mouse.up()
        page.wait_for_function("() => location.hash.includes('zoom=')")
        assert page.url.startswith(url + "trends")  # a drag does not open a run
        if page.evaluate("document.documentElement.scrollHeight > innerHeight + 1"):
            page.keyboard.down("Control")  # the wheel alone scrolls a page that is longer than the screen
        page.mouse.wheel(0, 400)
        page.keyboard.up("Control")
        page.wait_for_function("() => !location.hash.includes('zoom=')")
        plot.focus()
        page.keyboard.press("End")
        page.keyboard.press("Enter")
        tab.until("window.livebode?.bode.curves.measured")
        assert "/run/day%205/#at=" in page.url
        assert page.locator("#status-text").inner_text().startswith("day 5")
        page.locator("#back").click()
        page.locator("[data-run='day 5']").wait_for()
        assert tab.wrong == []


def test_runs_without_a_clock_are_listed_apart_and_shown_where_a_search_finds_no_others(
    browser: Browser, url: str
) -> None:
    with Tab(browser, url + "trends#find=clock", wait=False, viewport=PHONE) as tab:
        page = tab.page
        assert page.evaluate(_SEARCHES) == []  # a search finds what has all its words, and orders are total
        page.wait_for_function("() => document.getElementById('cards').dataset.runs === '1'")
        page.locator("[data-name='two-mass/Keff'] canvas").wait_for()
        assert "hollow points" in page.locator("#apart-title").inner_text()
        page.locator("#apart summary").click()
        page.locator("#by-written").uncheck()
        page.wait_for_function("() => !document.querySelector('.trend-card')")
        assert page.locator("#apart-runs a").get_attribute("href") == "/run/no%20clock/"
        page.locator("#search").fill("")
        page.locator("[data-name='two-mass/Keff'] canvas").wait_for()
        assert "not in the charts" in page.locator("#apart-title").inner_text()
        page.locator("#search").fill("clock")
        page.locator("#by-written").check()
        page.locator("[data-name='two-mass/Keff'] canvas").wait_for()
        page.locator("#table summary").click()
        page.locator("#table-rows tr").nth(10).wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert tab.wrong == []


def test_the_header_of_the_list_and_of_the_trends_fits_a_phone(browser: Browser, url: str) -> None:
    for path, ready in (("", "#rows [data-run]"), ("trends", ".trend-card canvas")):
        with Tab(browser, url + path, wait=False, viewport=PHONE) as tab:
            tab.page.locator(ready).first.wait_for()
            tab.page.evaluate("() => { document.getElementById('count').textContent = '1234 runs'; }")
            assert tab.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"], path


def test_a_quantity_that_two_models_have_is_shown_with_the_model(browser: Browser, url: str) -> None:
    with Tab(browser, url + "trends#find=day", wait=False) as tab:
        tab.page.locator("[data-name='two-mass/resonance'] canvas").wait_for()
        shared = tab.page.evaluate(
            """async () => {
              const { quantitiesOf } = await import("/static/trends_data.js");
              const point = (model, name, unit) => [model, name, unit, 1, 0.1, 0.9, 1.1, 0, 5, 3];
              const runs = ["a", "b"].map((name) => ({ name, begun: 5 }));
              const trends = new Map([
                ["a", { points: [point("two-mass", "resonance", "Hz"), point("two-mass", "Keff", "N/m")], alarms: [] }],
                ["b", { points: [point("two-mass-gain", "resonance", "Hz")], alarms: [] }]]);
              return quantitiesOf(runs, trends, false).quantities.filter((q) => q.model).map((q) => [q.name, q.shared]);
            }"""
        )
    assert shared == [["resonance", True], ["resonance", True], ["Keff", False]]


def test_both_pages_have_no_english_outside_of_their_catalogue(browser: Browser, url: str) -> None:
    answer = json.dumps(asdict(pseudo()) | {"languages": {"en": "English"}})
    data = {
        "livebode",
        "weeks",
        "alert",
        "onerror",
        "clock",
        "json",
        "broken",
        "Keff",
        "direct",
        "parquet",
        "belt",
        "service",
        "after",
        "joint",
    }
    with Tab(browser, "about:blank", wait=False) as tab:
        tab.page.route("**/catalogue*", lambda route: route.fulfill(body=answer, content_type="application/json"))
        for path, ready in (("", "#rows [data-run]"), ("trends", ".trend-card canvas")):
            tab.page.goto(url + path)
            tab.page.locator(ready).first.wait_for()
            assert untranslated(tab.page.evaluate(_TEXTS), data) == set(), path


_TEXTS = r"""() => {
  const found = [...document.querySelectorAll("*")].flatMap((e) => [e.title, e.ariaLabel, e.placeholder]);
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) found.push(walker.currentNode.data);
  return found.join("\n");
}"""


_SEARCHES = """async () => {
  const { found, ordered, ORDERS, tagWord, words } = await import("/static/runs_search.js");
  let seed = 7;
  const next = (n) => (seed = (seed * 16807) % 2147483647) % n;
  const some = ["belt", "Riemen", "ﬁt", "5", "#7", 'a"b', "after service", "Ä", "张伟", "(x", "\\\\", " "];
  const pick = () => some[next(some.length)];
  const wrong = [];
  const runs = Array.from({ length: 60 }, (_, i) => ({
    name: `${pick()} ${i}`, notes: pick() + pick(), machine: pick(), recording: "", signals: pick(), words: "",
    estimator: "", model: "", tags: [pick(), pick()].filter((t) => t.trim()), begun: next(2) ? next(9) : null,
    written: next(9), duration_s: null, lines: next(3), tone: "ok", size_bytes: next(3),
  }));
  for (const run of runs) {
    for (const text of [run.name, run.notes, run.machine])
      if (!/["#]/.test(text) && !found(run, words(text))) wrong.push(["own text", text]);
    for (const tag of run.tags) if (!found(run, words(tagWord(tag)))) wrong.push(["own tag", tag]);
  }
  for (let i = 0; i < 300; i++) {
    const [a, b] = [pick(), pick()].map((word) => word.replaceAll('"', ""));
    const both = runs.filter((run) => found(run, words(`${a} ${b}`)));
    const each = runs.filter((run) => found(run, words(a)) && found(run, words(b)));
    if (JSON.stringify(both) !== JSON.stringify(each)) wrong.push(["both words", a, b]);
    const tag = pick(), plain = (t) => t.normalize("NFKC").toLowerCase().replaceAll('"', "");
    const tagged = runs.filter((run) => run.tags.some((t) => plain(t) === plain(tag)));
    if (tag.trim() && runs.filter((run) => found(run, words(tagWord(tag)))).length !== tagged.length)
      wrong.push(["tag", tag]);
  }
  for (const by of ORDERS)
    for (const down of [true, false]) {
      const order = (list) => ordered(list, by, down).map((run) => run.name).join("\\n");
      if (order(runs) !== order(runs.toReversed())) wrong.push(["order", by]);
    }
  return wrong;
}"""
