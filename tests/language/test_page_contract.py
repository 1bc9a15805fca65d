"""The page: its language, its sentences, and that it recognises what Python recognises."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from playwright.sync_api import Browser

from livebode.dashboard import Dashboard, Serving
from livebode.language import catalogue, in_language, recognised
from tests.support.browser import Tab
from tests.support.dashboards import Watched
from tests.support.languages import filled, pseudo, untranslated


def test_the_page_recognises_what_python_recognises(browser: Browser) -> None:
    sentences = [filled(template) for template, _ in catalogue("de").recorded]
    sentences += [f"{a}; {b}." for a, b in zip(sentences[::3], sentences[1::3])]
    sentences += ["the average up to 2026-03-01 07:30:05 CET s", "an unknown thing. 3 samples were lost."]
    with Dashboard(Serving("127.0.0.1", 0, language="de")) as dashboard, Tab(browser, dashboard.url, wait=False) as tab:
        found = tab.page.evaluate(
            "async (all) => all.map((await import('/static/recognition.js')).recognised)",
            sentences,
        )
        assert tab.page.evaluate("document.documentElement.lang") == "de"
        assert tab.wrong == []
    with in_language("de"):
        assert found == [recognised(sentence) for sentence in sentences]


def test_the_page_has_no_english_outside_of_its_catalogue(browser: Browser, tmp_path: Path) -> None:
    answer = json.dumps(asdict(pseudo()) | {"languages": {"en": "English"}})
    with Watched(tmp_path / "run") as watched:
        watched.go(6000)
        with Tab(browser, "about:blank", wait=False) as tab:
            tab.page.route("**/catalogue*", lambda route: route.fulfill(body=answer, content_type="application/json"))
            tab.page.goto(watched.url)
            tab.until("bode.curves.measured && document.querySelector('#events [role=row] time')")
            found = set()
            for name in ("map", "parameters", "margins"):
                tab.page.locator(f"#tab-{name}").click()
                tab.until("!page.dirty.has('trends')")
                data = {"livebode", "axis", "English", "Keff", "Enter", "Shift"}
                found |= untranslated(tab.page.evaluate(_TEXTS), data)
            assert found == set()
            assert "⟦Bode plot⟧" in tab.page.locator("body").inner_text()
            assert tab.wrong == []


_TEXTS = """() => {
  const titles = [...document.querySelectorAll("[title], [aria-label]")];
  const labels = titles.flatMap((e) => [e.title, e.getAttribute("aria-label") ?? ""]);
  return [document.body.textContent, ...labels].join("\\n");
}"""


def test_the_page_follows_the_configuration_and_then_the_choice_of_its_user(browser: Browser) -> None:
    with (
        Dashboard(Serving("127.0.0.1", 0, language="zh-CN")) as dashboard,
        Tab(browser, dashboard.url, wait=False, locale="de-AT") as tab,
    ):
        label = tab.page.locator("#axis-label")
        tab.until("livebode.page")
        assert (label.text_content() or "").strip() == "轴"
        tab.page.evaluate("document.getElementById('help').click()")
        with tab.page.expect_navigation():
            tab.page.locator("#language").select_option("de")
        tab.until("livebode.page")
        assert (label.text_content() or "").strip() == "Achse"
        assert tab.wrong == []
