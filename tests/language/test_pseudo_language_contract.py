"""Report and page in a pseudo language with sentences in brackets: what is outside of brackets was not translated."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from livebode.core import Event
from livebode.language import Catalogue, catalogue, in_language
from livebode.report.html import to_html
from livebode.reporting.compare_report import Comparison
from livebode.reporting.run_report import run_report
from tests.support.browser import Tab, chromium
from tests.support.dashboards import Watched
from tests.support.reports import measured, strokes, write_run

_WORD = re.compile(r"[A-Za-z]{4,}")


def pseudo() -> Catalogue:
    """German, with each translation replaced by the English sentence in brackets."""
    german = catalogue("de")

    def bracketed(english: str, translation: Any) -> Any:
        return f"⟦{english}⟧" if isinstance(translation, str) else [f"⟦{english}⟧"] * len(translation)

    messages = {english: bracketed(english, own) for english, own in german.messages.items()}
    recorded = tuple((english, f"⟦{english}⟧") for english, _ in german.recorded)
    return Catalogue(**asdict(german) | {"code": "eo", "messages": messages, "recorded": recorded})


def untranslated(text: str, data: set[str]) -> set[str]:
    """Words that are neither in brackets nor data."""
    while (shorter := re.sub(r"⟦[^⟦⟧]*⟧", " ", text)) != text:
        text = shorter
    return {word for word in _WORD.findall(text) if word not in data}


def visible(page: str) -> str:
    """The texts of a page without its style, its script and its settings."""
    page = re.sub(r"<style>.*?</style>|<pre>.*?</pre>|<defs>.*?</defs>", " ", page, flags=re.S)
    labels = " ".join(re.findall(r'aria-label="([^"]*)"', page))
    return re.sub(r"<[^>]*>", " ", page) + labels


CONFIGURATION = {
    "source": {"log": "bench.csv"},
    "signals": {"input": "curr", "output": "velo", "excitation": "exci", "schedule": "posi"},
    "tracking": {"estimator": "joint", "noise": "auto", "average": False, "hann": True},
    "fit": {"model": "rigid"},
}
EVENTS = (
    Event("gap", 900, 0.2, "12 samples are missing before sample 900; use other lines", {}),
    Event("change", 9000, 2.2, "Since 1.5 s the belt's stiffness is 10.0 ± 0.1 % less than in the baseline.",
          {"what": "stiffness"}),
)  # fmt: skip
DATA = {"bench", "html", "livebode", "unknown", "avx512", "Hann"}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("runs")
    one, other = (measured(120, seed, schedule=strokes(120), resonance_hz=f) for seed, f in ((1, 62.0), (2, 63.0)))
    paths = folder / "aaa", folder / "bbb"
    for path, responses in zip(paths, (one, other)):
        write_run(path, responses, configuration=CONFIGURATION, events=EVENTS)
    return paths


def test_a_report_has_no_english_outside_of_its_catalogue(runs: tuple[Path, Path]) -> None:
    with in_language(pseudo()):
        page = to_html(run_report(runs[0], made=datetime.now(UTC)))
    assert '<html lang="eo">' in page
    assert untranslated(visible(page), DATA | {"curr", "velo", "exci", "posi", "instruction"}) == set()
    assert ">0,5<" in page  # ticks of the coherence


def test_a_comparison_has_no_english_outside_of_its_catalogue(runs: tuple[Path, Path]) -> None:
    comparison = Comparison.of(*runs)
    with in_language(pseudo()):
        page = to_html(comparison.document(datetime.now(UTC)))
    for path in runs:
        page = page.replace(str(path), "")
    assert untranslated(visible(page), DATA | {"Bonferroni"}) == set()
    assert not any("⟦" in finding.text for finding in comparison.sentences)  # the terminal is English


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


def test_the_page_has_no_english_outside_of_its_catalogue(browser: Browser, tmp_path: Path) -> None:
    answer = json.dumps(asdict(pseudo()) | {"languages": {"en": "English"}})
    with Watched(tmp_path / "run") as watched:
        watched.go(6000)
        with Tab(browser, "about:blank", wait=False) as tab:
            tab.page.route("**/catalogue*", lambda route: route.fulfill(body=answer, content_type="application/json"))
            tab.page.goto(watched.url)
            tab.until("bode.curves.measured && document.querySelector('#events li time')")
            found = set()
            for name in ("map", "parameters", "margins"):
                tab.page.locator(f"#tab-{name}").click()
                tab.until("!page.dirty.has('trends')")
                found |= untranslated(tab.page.evaluate(_TEXTS), {"livebode", "axis", "English", "Keff"})
            assert found == set()
            assert "⟦Bode plot⟧" in tab.page.locator("body").inner_text()
            assert tab.wrong == []


_TEXTS = """() => {
  const titles = [...document.querySelectorAll("[title], [aria-label]")];
  const labels = titles.flatMap((e) => [e.title, e.getAttribute("aria-label") ?? ""]);
  return [document.body.textContent, ...labels].join("\\n");
}"""
