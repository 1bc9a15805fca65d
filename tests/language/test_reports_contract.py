"""Reports in a pseudo language with sentences in brackets: what is outside of brackets was not translated."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path

import pytest

from livebode.core import Event, moment
from livebode.language import Message, in_language
from livebode.monitoring.sentences import WHAT
from livebode_reports.compare_report import Comparison
from livebode_reports.html import to_html
from livebode_reports.run_report import run_report
from tests.support.languages import pseudo, untranslated
from tests.support.reports import measured, strokes, write_run


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
    Event(
        "gap",
        900,
        0.2,
        Message("{missing_samples} samples are missing before sample {at_sample}", missing_samples=12, at_sample=900),
    ),
    Event(
        "change",
        9000,
        2.2,
        Message(
            "Since {since} {change}.",
            since=moment(1.5),
            change=Message(
                "{part} is {size} % {way} than {reference}",
                part=WHAT["stiffness"],
                size=Message("{size:.1f} ± {bound:.1f}", size=10.0, bound=0.1),
                way=Message("less"),
                reference=Message("in the baseline"),
            ),
        ),
        {"what": "stiffness"},
    ),
)
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
