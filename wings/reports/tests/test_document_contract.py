"""A report is one file that needs nothing else, in which data are text and nothing but text, and holds no secret."""

from __future__ import annotations

import re
import sys
import tomllib
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from pypdf import PdfReader

from livebode.core import Document, Event, Finding, Listing, Paragraph, Picture, PrintedTable, Section, install_command
from livebode_reports.html import to_html
from livebode_reports.pdf import save_pdf
from livebode_reports.run_report import run_report
from livebode_reports.svg import pictures_svg
from livebode_reports.wording import to_toml
from tests.support.command import livebode
from tests.support.recorded import machine, record_machine
from tests.support.reports import Page, measured, strokes, write_run

MADE = datetime(2026, 11, 21, 12, tzinfo=UTC)
HOSTILE = (
    "<script>alert(1)</script>", "</title><img src=http://evil/x onerror=alert(1)>", "]]></style><b>", "&lt;i&gt;",
    "</text></svg><script>1</script>", "<font color=red><para>", "$x_{$",
    "\x00\x1b[31m\u202e", '"onload="x', "a" * 3000,
)  # fmt: skip
# What a page is made of; figures add those of SVG.
PAGE = {
    *("html", "head", "meta", "title", "style", "body", "header", "main", "section", "footer", "nav", "a"),
    *("p", "h1", "h2", "dl", "div", "dt", "dd", "ul", "li", "span", "pre", "figure", "figcaption"),
    *("table", "thead", "tbody", "tr", "th", "td"),
    *("svg", "defs", "g", "path", "use", "text", "tspan", "clippath", "rect", "image"),
}


def hostile(text: str, pictures: bool = False) -> Document:
    """A document with the text wherever one can be."""
    data = {"responses": measured(6, 1), "schedule_name": text}
    bode = {"responses": measured(6, 1, unit=text), "names": (text, text)}
    curves = {"time_s": np.arange(3.0), "curves": [(text, text, np.ones(3), np.ones(3))]}
    drawn = (Picture("bode", bode, text), Picture("tracking", data, text), Picture("parameters", curves, text))
    parts = (
        Paragraph(text),
        PrintedTable((text, "n"), ((text, text),), (1,), text),
        Listing(text),
        *drawn[1:] * pictures,
    )
    sections, finding = (Section(text, parts),), Finding("alarm", text)
    return Document(
        text, text, ((text, text),), (finding,), sections, text, text, result=(finding, finding),
        picture=drawn[0] if pictures else None, signatures=(text, text), appendix=sections[: not pictures],
    )  # fmt: skip


def check_text_and_nothing_else(text: str, path: Path, pictures: bool) -> None:
    document = hostile(text, pictures)
    drawn = pictures_svg(document)
    page, plain = Page(to_html(document, drawn)), plain_page(pictures)
    assert {tag for tag, _ in page.tags} <= PAGE
    assert [tag for tag, _ in page.tags if tag not in ("text", "tspan", "path", "use", "g", "defs")] == [
        tag for tag, _ in plain.tags if tag not in ("text", "tspan", "path", "use", "g", "defs")
    ]
    for _, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")]
    if text.isprintable() and text.strip() == text:
        assert " ".join(text.split()) in page.text
    save_pdf(document, path, drawn)
    reader = PdfReader(path)
    if text.isascii() and text.isprintable() and text.strip() == text and len(text) < 40 and "  " not in text:
        assert text in " ".join(reader.pages[0].extract_text().split())


@cache
def plain_page(pictures: bool) -> Page:
    return Page(to_html(hostile("plain", pictures)))


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.text(min_size=1, max_size=60) | st.text("<>&\"'/=#$*_[]\\scriptm ", min_size=3, max_size=30))
@example(text='#image("/etc/passwd") $x$ *b* @r <l>')
@example(text=HOSTILE[9])
@example(text="\U0001d5a9\U0001ee6d\ue001\u0301\ufffe")  # letters of one weight only, private, combining
def test_data_are_text_and_nothing_else(text: str, tmp_path: Path) -> None:
    check_text_and_nothing_else(text, tmp_path / "a.pdf", pictures=False)


def test_data_are_text_and_nothing_else_in_pictures(tmp_path: Path) -> None:
    check_text_and_nothing_else("".join(HOSTILE[:9]), tmp_path / "a.pdf", pictures=True)


def references(html: str) -> list[str]:
    """Everything that a browser would fetch."""
    found = re.findall(r"url\(([^)]*)\)|@import\s+(\S+)", html)
    page = Page(html)
    named = [
        v for _, a in page.tags for k, v in a.items() if k.split(":")[-1] in ("href", "src", "srcset", "data") and v
    ]
    return [f for pair in found for f in pair if f] + named


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a schedule, hostile names and events."""
    events = [Event("change", 9, 0.1, f"{HOSTILE[0]} {i}", {}) for i in range(60)]
    events += [Event("gap", 9, float(i), HOSTILE[1], {}) for i in range(3000)]
    names = {"output": HOSTILE[0], "input": HOSTILE[1], "excitation": "$x_{$", "schedule": "</svg><script>"}
    source = {"url": "mqtts://broker/<script>", "username": "ann", "password_env": "PLC_PASSWORD"}
    configuration = {"source": source, "signals": names}
    folder = tmp_path_factory.mktemp("moving")
    responses = measured(5000, 1, schedule=strokes(5000))
    return write_run(folder / "run", responses, configuration=configuration, events=events)


def test_a_report_needs_nothing_else_and_holds_no_secret(moving: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLC_PASSWORD", "hunter2-is-secret")
    done = livebode("report", moving)
    assert done.code == 0, done.err
    html = (moving / "report.html").read_text("utf-8")
    for reference in references(html):
        assert reference.startswith(("#", "data:image/png;base64,")), reference
    assert "default-src 'none'" in html
    assert not [tag for tag, _ in Page(html).tags if tag in ("script", "link", "iframe", "object", "embed", "img")]
    pdf = PdfReader(moving / "report.pdf")
    text = "\n".join(page.extract_text() for page in pdf.pages)
    for where in (html, text):
        assert "hunter2" not in where
        assert "<script>alert(1)</script>" not in html
    rest = html.replace('http-equiv="', "").replace('xmlns="http://www.w3.org/2000/svg"', "")
    assert "http" not in re.sub(r"&lt;.*?&gt;", "", rest)


def test_long_logs_are_grouped_and_long_runs_thinned_with_a_note(moving: Path) -> None:
    document = run_report(moving, made=MADE)
    (events,) = (s for s in document.sections if s.title == "Alarms and events")
    grouped, in_full = (p for p in events.parts if isinstance(p, PrintedTable))
    assert {row[0]: row[1] for row in grouped.rows} == {"change": "60", "gap": "3,000"}
    assert len(in_full.rows) == 40
    assert "20 events between them not shown" in in_full.note
    pictures = {p.what: p for p in document.pictures}
    assert len(pictures["bode"].data["responses"]) <= 2048
    drawn = len(pictures["tracking"].data["responses"])
    assert 250 < drawn <= 500
    assert f"{drawn} of 5,000 responses)" in pictures["tracking"].caption


def test_pages_are_numbered_and_sections_are_in_the_outline(tmp_path: Path) -> None:
    document = run_report(write_run(tmp_path / "run", measured(30, 1)), made=MADE)
    save_pdf(document, tmp_path / "a.pdf")
    save_pdf(document, tmp_path / "b.pdf")
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()
    reader = PdfReader(tmp_path / "a.pdf")
    texts = [page.extract_text() for page in reader.pages]
    for i, (page, text) in enumerate(zip(reader.pages, texts), 1):
        assert f"{i} / {len(reader.pages)}" in text
        assert [float(side) for side in page.mediabox[2:]] == pytest.approx([595.28, 841.89], abs=0.1)
    title, sections = reader.outline
    assert title["/Title"] == document.title
    assert [entry["/Title"] for entry in sections] == [
        document.heading, *(s.title for s in (*document.sections, *document.appendix))
    ]  # fmt: skip


def test_the_report_of_an_unfinished_run_states_that_it_is_unfinished(tmp_path: Path) -> None:
    def stop(done: int, _: int | None) -> None:
        if done > 2500:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record_machine(machine(8000), tmp_path / "run", progress=stop)
    done = livebode("report", tmp_path / "run", "--out", tmp_path / "r")
    assert done.code == 0, done.err
    assert "The run is not finished" in Page((tmp_path / "r.html").read_text("utf-8")).text
    again = livebode("report", tmp_path / "run", "--out", tmp_path / "r.pdf")
    assert (again.code, "exists already" in again.err) == (2, True)
    assert livebode("report", tmp_path / "run", "--out", tmp_path / "r", "--force").code == 0
    assert {p.name for p in tmp_path.iterdir()} == {"run", "r.html", "r.pdf"}


def test_directories_without_a_valid_response_are_refused(tmp_path: Path) -> None:
    none = measured(5, 1)
    none.valid[:] = False
    for run, words in (
        (tmp_path, "not the directory of a run"),
        (write_run(tmp_path / "n", none), "valid at any line"),
    ):
        done = livebode("report", run)
        assert (done.code, words in done.err) == (2, True), done.err
    assert not list(tmp_path.glob("**/report.*"))


def test_figures_are_vectors_with_text_that_can_be_searched(tmp_path: Path) -> None:
    data = {"responses": measured(6, 1), "names": ("u", "ω")}
    section = Section("Average", (Picture("bode", data, "caption"),))
    facts, verdict = (("rate", "4 kHz"),), (Finding("ok", "no change"),)
    save_pdf(Document("run", "Report", facts, verdict, (section,), "foot"), tmp_path / "a.pdf")
    (page,) = PdfReader(tmp_path / "a.pdf").pages
    text = page.extract_text()
    assert ("frequency in Hz" in text, "phase in degrees" in text, "u to ω" in text) == (True, True, True)
    assert not page.images


def test_without_typst_the_page_is_written_and_the_missing_pdf_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = write_run(tmp_path / "run", measured(20, 1))
    monkeypatch.setitem(sys.modules, "typst", None)
    monkeypatch.delitem(sys.modules, "livebode_reports.pdf", raising=False)
    done = livebode("report", run)
    assert done.code == 0, done.err
    assert f"Typst is not installed; run {install_command('pdf')}" in done.out
    assert (run / "report.html").is_file()
    assert not (run / "report.pdf").exists()


TEXTS = ("--company", "Drives Ltd", "--customer", "Muster AG", "--conditions", "20 degrees, no load")


def test_the_first_page_is_from_template_and_options_on_the_paper_that_is_asked_for(tmp_path: Path) -> None:
    run, template = write_run(tmp_path / "run", measured(20, 1)), tmp_path / "t.toml"
    template.write_text('[report]\nmachine = "M"\noperator = "Ann"\npaper = "letter"\n', encoding="utf-8")
    done = livebode("report", run, "--template", template, "--operator", "Bob <b>", *TEXTS, "--out", tmp_path / "r")
    assert done.code == 0, done.err
    page = PdfReader(tmp_path / "r.pdf").pages[0]
    assert [float(side) for side in page.mediabox[2:]] == [612, 792]
    text = page.extract_text()
    assert ("Bob <b>" in text, "Ann" in text, "not judged" in text) == (True, False, True)
    assert "size: letter" in (tmp_path / "r.html").read_text("utf-8")
    assert all(words in text for words in TEXTS[1::2])
    compared = livebode("compare", run, run, *TEXTS, "--out", tmp_path / "c")
    assert compared.code == 0, compared.err
    assert all(words in (tmp_path / "c.html").read_text("utf-8") for words in TEXTS[1::2])


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (("--ask",), "--ask needs a terminal"),
        (("--check",), "--check needs limits"),
        (("--paper", "a5"), "Input should be 'a4' or 'letter'; correct it (option --paper)"),
        (("--logo", "none.png"), "the logo 'none.png' cannot be read"),
        (("--machine", "x" * 600), "more than 500 letters"),
        (("--template", "none.toml"), "there is no file none.toml"),
    ],
    ids=str,
)
def test_options_that_are_not_possible_are_refused_before_a_file_is_written(
    options: tuple[str, ...], why: str, tmp_path: Path
) -> None:
    run = write_run(tmp_path / "run", measured(20, 1))
    done = livebode("report", run, *options)
    assert (done.code, why in done.err, done.err.count("\n")) == (2, True, 1), done.err
    assert not list(run.glob("report.*"))
    if options[0] not in ("--check", "--ask"):
        assert livebode("compare", run, run, *options).code == 2


_NAMES = st.text(min_size=1, max_size=8)
_VALUES = st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | st.text(max_size=20)


@given(values=st.recursive(
    st.dictionaries(_NAMES, _VALUES | st.lists(st.text(max_size=5), max_size=3), max_size=4),
    lambda inner: st.dictionaries(_NAMES, inner, max_size=3), max_leaves=5,
))  # fmt: skip
def test_settings_read_back_as_what_they_are(values: dict[str, Any]) -> None:
    assert tomllib.loads(to_toml(values)) == _without_none(values)


def _without_none(values: dict[str, Any]) -> dict[str, Any]:
    return {k: _without_none(v) if isinstance(v, dict) else v for k, v in values.items() if v is not None}
