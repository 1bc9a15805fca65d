"""The page: its language, its sentences, and that it words what Python words."""

from __future__ import annotations

import json
import re
from dataclasses import asdict
from pathlib import Path

from playwright.sync_api import Browser

from livebode.core import RunClock, moment, moments_by
from livebode.dashboard import Dashboard, ServerSettings
from livebode.language import Message, catalogue, for_page, in_language, worded
from tests.support.browser import Tab
from tests.support.dashboards import Watched
from tests.support.languages import pseudo, untranslated

_PLACES = re.compile(r"\{(\w+)(:[^{}]*)?\}")


def test_the_page_words_what_python_words(browser: Browser) -> None:
    templates = [text for text, own in catalogue("de").messages.items() if "{" in text and isinstance(own, str)]
    inner = Message("{missing_samples} samples were lost", missing_samples=12)
    numbers = {name: -1234.5 for text in templates for name, spec in _PLACES.findall(text) if spec}
    with moments_by(RunClock([(0.0, 1.7e9)])):
        messages = [
            *(Message(text, **_facts(text, inner)) for text in templates),
            *(Message("{amount:.2f} {unit}", amount=number, unit="1.5") for number in numbers.values()),
            Message("Only larger changes are found: {changes}.", changes=[inner, "a.b", 3]),
            Message("Monitored again since {at}.", at=moment(12.25)),
            Message("Monitored again since {at}.", at=moment(float("nan"))),
            "no response",
            "a channel",
        ]
    with (
        Dashboard(ServerSettings("127.0.0.1", 0, language="de")) as dashboard,
        Tab(browser, dashboard.url, wait=False) as tab,
    ):
        found = tab.page.evaluate(
            "async (all) => all.map((await import('/static/worded.js')).worded)",
            [for_page(message) for message in messages],
        )
        assert tab.page.evaluate("document.documentElement.lang") == "de"
        assert tab.wrong == []
    with in_language("de"):
        assert found == [worded(message) for message in messages]


def _facts(template: str, inner: Message) -> dict[str, Message | float]:
    """A value for each place of a template, and for no other: each value is sent to the page, and worded there."""
    places = _PLACES.findall(template)
    return {name: inner for name, spec in places if not spec} | {name: 12.5 for name, spec in places if spec}


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
                tab.settle()
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
        Dashboard(ServerSettings("127.0.0.1", 0, language="zh-CN")) as dashboard,
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
