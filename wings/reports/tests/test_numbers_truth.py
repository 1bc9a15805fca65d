"""What a report says and draws is what the run holds: its tables, verdict and pictures, on the page and on paper."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pypdf import PdfReader
from pypdf.generic import DictionaryObject

from livebode.core import Document, Picture, PrintedTable
from livebode.fitting import mean_response
from livebode.records import RunRecord
from livebode_reports.compare_report import Comparison
from livebode_reports.run_report import run_report
from livebode_reports.svg import drawn, pictures_svg
from livebode_reports.wording import polar_phrase
from tests.support.command import livebode
from tests.support.drawn_svg import checked, paths_of
from tests.support.loop_runs import AXIS, record
from tests.support.reports import LINES, Page, measured, plant, strokes, write_run

REPORT = """
[report]
machine = "Axis 7"
serial_number = "S-0471"
operator = "Ann"
customer = "Muster AG"
conditions = "22 °C, empty carriage"
logo = "logo.svg"
[[report.limits]]
quantity = "resonance_hz"
min = 50
[[report.limits]]
quantity = "phase_margin_deg"
min = 45
[[report.limits]]
quantity = "max_sensitivity"
max = 1.0
[[report.limits]]
quantity = "|T|"
max = 3
band_hz = [100, 400]
"""
LOGO = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 3"><rect width="9" height="3" fill="#0b5fa5"/></svg>'
MADE = datetime(2026, 11, 21, 12, tzinfo=UTC)


def parts(document: Document, kind: type, title: str) -> list:
    sections = (*document.sections, *document.appendix)
    return [p for s in sections if s.title == title for p in s.parts if isinstance(p, kind)]


def marks(panel, name: str) -> list:
    return [mark for mark in panel.marks if getattr(mark, "name", "") == name]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two masses in their loop, with fit and margins, two seconds with a sample that is not finite."""
    folder = tmp_path_factory.mktemp("loop")
    record(folder / "log.parquet", 1)
    record(folder / "fresh.parquet", 2)
    (folder / "axis.toml").write_text(AXIS.format(gain=0.2308, delay=0) + REPORT, encoding="utf-8")
    (folder / "logo.svg").write_text(LOGO, encoding="utf-8")
    assert livebode("run", folder / "axis.toml", "--out", folder / "run").code == 0
    done = livebode("report", folder / "run", "--on", folder / "fresh.parquet", "--appendix")
    assert done.code == 0, done.err
    files = [str(folder / "run" / name) for name in ("report.html", "report.pdf")]
    assert done.out.splitlines()[:3] == [*files, "limits: 3 met, 1 failed"]
    return folder / "run"


def test_the_table_of_lines_is_the_mean_with_its_bounds(run: Path) -> None:
    document = run_report(run, made=MADE)
    (table,) = parts(document, PrintedTable, "Frequency response")
    responses = RunRecord.open(run).responses()
    mean = mean_response(responses)
    size, radius = np.abs(mean.value[0]), mean.bound(np.sqrt(np.log(20)))[0]
    for row, f, db, r, angle, c in zip(
        table.rows, mean.lines.frequency_hz, 20 * np.log10(size), radius / size, np.angle(mean.value[0]),
        np.nanmean(np.where(responses.valid, responses.coherence, np.nan), axis=0),
    ):  # fmt: skip
        assert float(row[0]) == f
        assert float(row[1]) == pytest.approx(db, abs=0.005)
        assert float(row[2]) == pytest.approx(-20 * np.log10(1 - r), rel=0.05)
        assert float(row[3]) == pytest.approx(np.degrees(angle), abs=0.005)
        assert float(row[4]) == pytest.approx(np.degrees(np.arcsin(r)), rel=0.05)
        assert float(row[5]) == pytest.approx(c, abs=1e-4)


def test_the_picture_draws_the_mean_its_bounds_and_the_fit(run: Path) -> None:
    document = run_report(run, made=MADE)
    picture = document.picture
    assert picture is not None
    magnitude, phase, _ = drawn(picture).panels
    mean = mean_response(RunRecord.open(run).responses())
    size, radius = np.abs(mean.value[0]), mean.bound(np.sqrt(np.log(20)))[0]
    np.testing.assert_allclose(marks(magnitude, "newest")[0].y, 20 * np.log10(size))
    (bars,) = marks(magnitude, "bound")
    ends = np.column_stack([bars.low, bars.high])
    np.testing.assert_allclose(ends, 20 * np.log10(np.column_stack([size - radius, size + radius])))
    turned = np.exp(1j * np.radians(marks(phase, "newest")[0].y))
    np.testing.assert_allclose(turned, mean.value[0] / size)
    (curve,) = marks(magnitude, "fit")
    fitted = picture.data["fitted"].response(curve.x)
    np.testing.assert_allclose(curve.y, 20 * np.log10(np.abs(fitted)))


def test_parameters_over_time_are_those_of_the_table(run: Path) -> None:
    document = run_report(run, made=MADE)
    (picture,) = parts(document, Picture, "Parameters")
    rows = [
        row
        for table in map(pa.table, RunRecord.open(run).tables("parameters"))
        for row in table.to_pylist()
        if row["name"] == "Keff"
    ]
    curves = {name: (value, half) for name, _, value, half in picture.data["curves"]}
    np.testing.assert_array_equal(curves["Keff"][0], [row["value"] for row in rows])
    np.testing.assert_allclose(curves["Keff"][1], 1.959964 * np.array([row["sigma"] for row in rows]))
    (table,) = parts(document, PrintedTable, "Parameters")
    keff = next(row for row in table.rows if row[0] == "belt stiffness")
    newest = next(row for row in reversed(rows) if row["status"] == "ok")
    assert float(keff[3]) == pytest.approx(newest["value"], rel=1e-3)
    assert float(keff[4]) == pytest.approx(1.96 * newest["sigma"], rel=0.05)
    held = json.loads(livebode("fit", run, "--json").out)["quantities"]["Keff"]
    assert float(keff[1]) == pytest.approx(held["value"], rel=1e-3)
    assert float(keff[2]) == pytest.approx(held["bound_95"], rel=0.05)


def test_page_and_paper_hold_the_same_numbers(run: Path) -> None:
    document = run_report(run, made=MADE, appendix=True)
    page = Page((run / "report.html").read_text("utf-8")).text
    paper = " ".join("\n".join(p.extract_text() for p in PdfReader(run / "report.pdf").pages).split())
    for table in (t for s in document.sections for t in s.parts if isinstance(t, PrintedTable)):
        for row in table.rows:
            for text in row:
                if re.fullmatch(r"[-+]?[\d,.]+(e[-+]\d+)?", text):
                    assert text in page, (table.headings, row)
                    assert text in paper, (table.headings, row)
    for words in (
        "two-mass passes",
        "Worst margins",
        "1 sample of 8,000",
        "joint: S_wy/S_wu",
        "velocity: rate_hz 4000",
    ):
        assert words in page, words
        assert words in paper, words
    own = json.loads((run / "run.json").read_text("utf-8"))["loop"]["margins"]["phase_margin"]
    (margins,) = parts(document, PrintedTable, "Margins of the loop")
    row = next(row for row in margins.rows if row[0] == "phase margin")
    assert abs(float(row[1]) - own["value"]) < own["bound_95"]


def squeezed(text: str) -> str:
    return re.sub(r"\s", "", text)


def test_page_and_paper_have_the_same_content(run: Path) -> None:
    """Every letter of the page is on paper; paper repeats the headings of a table that continues on another sheet."""
    html = (run / "report.html").read_text("utf-8")
    (foot,) = re.findall(r"<footer>(.*?)</footer>", html, re.DOTALL)
    page = squeezed(Page(re.sub(r"<(title|nav|footer)>.*?</\1>", "", html, flags=re.DOTALL)).text)
    sheets = PdfReader(run / "report.pdf").pages
    paper = ""
    for i, sheet in enumerate(sheets, 1):
        text = squeezed(sheet.extract_text())
        assert text.count(squeezed(f"{foot} {i} / {len(sheets)}")) == 1
        paper += text.replace(squeezed(f"{foot} {i} / {len(sheets)}"), "")
    headings = {squeezed("".join(t.headings)) for s in run_report(run, made=MADE).sections for t in s.parts
                if isinstance(t, PrintedTable) and any(t.headings)}  # fmt: skip
    for heading in headings:
        paper = paper.replace(heading, "", paper.count(heading) - page.count(heading))
    assert Counter(paper) == Counter(page)


def test_the_pages_of_a_customer_have_no_command_no_configuration_and_no_path(run: Path) -> None:
    text = " ".join(squeezed(str(part)) for part in _texts(run_report(run, made=MADE)))
    for words in ("`", "--", "[fit]", "[report]", "velocity:rate_hz", str(run.parent), "…)"):
        assert squeezed(words) not in text, words
    last = run_report(run, made=MADE, appendix=True).appendix
    assert [section.title for section in last] == [
        "Frequency response", "Data quality", "Details of the measurement", "Source", "Settings", "Versions",
        "Not in this report",
    ]  # fmt: skip


def _texts(document: Document) -> list[object]:
    sections = (*document.sections, *document.appendix)
    parts = [part.caption if isinstance(part, Picture) else part for s in sections for part in s.parts]
    return [document.facts, document.result, document.verdict, document.foot, *parts]


def test_the_first_page_has_machine_verdict_one_picture_and_signatures(run: Path) -> None:
    first = squeezed(PdfReader(run / "report.pdf").pages[0].extract_text())
    for words in (
        "Acceptance report", "Axis 7", "S-0471", "22 °C, empty carriage", "FAIL",
        "1 limit of 4 is not met: peak sensitivity Ms ≤ 1", "frequency in Hz", "Ann: date, signature",
        "Muster AG: date, signature",
    ):  # fmt: skip
        assert squeezed(words) in first, words
    assert len(re.findall(r"<svg", (run / "report.html").read_text("utf-8").split("</header>")[0])) == 4  # three panels


def test_the_limits_are_judged_by_the_numbers_of_fit_margins_and_lines(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Only what the command prints is examined: page and paper of the same run are drawn once, for the other tests.
    monkeypatch.setattr("livebode_reports.svg.pictures_svg", lambda _: ())
    monkeypatch.setattr("livebode_reports.html.to_html", lambda *_: "")
    monkeypatch.setattr("livebode_reports.pdf.save_pdf", lambda _, path, __: path.write_bytes(b""))
    done = livebode("report", run, "--json", "--check", "--out", run.parent / "again")
    assert done.code == 4
    found = json.loads(done.out)
    assert found["verdict"] == "fail"
    resonance, phase, sensitivity, mask = found["limits"]
    fitted = json.loads(livebode("fit", run, "--json").out)["quantities"]["resonance"]
    assert resonance["value"] == pytest.approx(fitted["value"], rel=1e-3)
    assert resonance["bound_95"] == pytest.approx(fitted["bound_95"], rel=0.05)
    own = json.loads((run / "run.json").read_text("utf-8"))["loop"]["margins"]
    assert abs(phase["value"] - own["phase_margin"]["value"]) < own["phase_margin"]["bound_95"]
    assert (resonance["result"], phase["result"], sensitivity["result"], mask["result"]) == (
        "pass",
        "pass",
        "fail",
        "pass",
    )
    template = run.parent / "one.toml"
    template.write_text('[[report.limits]]\nquantity = "resonance_hz"\nmin = 50\n', encoding="utf-8")
    done = livebode("report", run, "--json", "--check", "--template", template, "--out", run.parent / "third")
    assert (done.code, json.loads(done.out)["verdict"]) == (0, "pass")


def test_the_pdf_is_tagged_archivable_and_contains_its_fonts(run: Path) -> None:
    """What PDF/A-2a and PDF/UA-1 require of metadata, colour, fonts and structure; the writer checks the rest."""
    root = PdfReader(run / "report.pdf").root_object
    metadata = root["/Metadata"].get_data().decode()
    for words in ("<pdfaid:part>2<", "<pdfaid:conformance>A<", "<pdfuaid:part>1<", "Axis 7: Acceptance report"):
        assert words in metadata
    (intent,) = root["/OutputIntents"]
    assert intent["/S"] == "/GTS_PDFA1"
    assert intent["/DestOutputProfile"].get_data()[36:40] == b"acsp"
    assert (root["/Lang"], root["/MarkInfo"]["/Marked"]) == ("en", True)
    assert root["/ViewerPreferences"]["/DisplayDocTitle"]
    assert not {"/AcroForm", "/OpenAction", "/AA"} & root.keys()
    kinds = Counter(str(element["/S"]) for element in _elements(root["/StructTreeRoot"]))
    assert {"/Document", "/H1", "/H2", "/P", "/Table", "/TR", "/TH", "/TD", "/Figure"} <= kinds.keys()
    figures = [e for e in _elements(root["/StructTreeRoot"]) if e["/S"] == "/Figure"]
    pictures = run_report(run, made=MADE).pictures
    assert {p.caption for p in pictures} <= {str(figure.get("/Alt")) for figure in figures}
    for page in PdfReader(run / "report.pdf").pages:
        for font in page["/Resources"].get("/Font", {}).values():
            (inner,) = font.get_object()["/DescendantFonts"]
            assert "/ToUnicode" in font.get_object()
            assert {"/FontFile2", "/FontFile3"} & inner.get_object()["/FontDescriptor"].keys()


def _elements(element: DictionaryObject) -> Iterator[DictionaryObject]:
    """The structure elements, in the order of reading."""
    if "/S" in element:
        yield element
    inner = element.get("/K", [])
    for one in inner if isinstance(inner, list) else [inner]:
        if isinstance(one.get_object(), DictionaryObject):
            yield from _elements(one.get_object())


@given(st.complex_numbers(min_magnitude=1e-6, max_magnitude=1e6), st.floats(0, 1e7) | st.just(np.inf) | st.just(np.nan))
def test_a_ratio_with_an_open_bound_is_described_by_what_is_known(ratio: complex, bound: float) -> None:
    words = polar_phrase(ratio, bound)
    assert "unbounded" not in words
    assert ("±" in words) == (bound < abs(ratio))
    if abs(ratio) <= bound < np.inf:
        most_db = float(words.removeprefix("at most ").split(" dB")[0])
        assert most_db == pytest.approx(20 * np.log10(abs(ratio) + bound), abs=0.006)


def test_the_svg_draws_the_numbers() -> None:
    time_s = np.arange(12.0)
    value = np.random.default_rng(1).normal(size=12)
    picture = Picture("parameters", {"time_s": time_s, "curves": [("k", "N/m", value, np.full(12, 0.1))]}, "")
    (svg,) = pictures_svg(Document("", "", (), (), (), picture=picture))
    ((_, (curve,)),) = paths_of(checked(svg), "value")
    # An affine image of the numbers, downwards where the page goes down.
    x, y = np.polyfit(time_s, curve[:, 0], 1), np.polyfit(value, curve[:, 1], 1)
    assert np.abs(np.polyval(x, time_s) - curve[:, 0]).max() < 0.6
    assert np.abs(np.polyval(y, value) - curve[:, 1]).max() < 0.6
    assert y[0] < 0 < x[0]


def test_before_and_after_draw_both_means_and_mark_what_differs(tmp_path: Path) -> None:
    runs = [measured(300, seed, resonance_hz=hz, schedule=strokes(300)) for seed, hz in ((1, 62.0), (2, 60.0))]
    paths = [write_run(tmp_path / str(i), r) for i, r in enumerate(runs)]
    comparison = Comparison.of(*paths)
    document = comparison.document(MADE)
    picture = document.picture
    assert picture is not None
    magnitude, _, ratio_db, ratio_deg = drawn(picture).panels
    ratio, true = (
        comparison.differences.overall.ratio,
        (plant(LINES.frequency_hz, 60) / plant(LINES.frequency_hz, 62))[0],
    )
    assert np.all(np.abs(ratio - true) < comparison.differences.overall.bound)
    for name, one in (
        ("before", comparison.differences.overall.before),
        ("after", comparison.differences.overall.after),
    ):
        np.testing.assert_allclose(marks(magnitude, name)[0].y, 20 * np.log10(np.abs(one.value)))
    marked = np.concatenate([marks(ratio_db, "differs")[0].x, marks(ratio_deg, "differs")[0].x])
    differing = LINES.frequency_hz[comparison.differences.overall.differs]
    np.testing.assert_array_equal(marked, np.tile(differing, 2))
    assert 60 in differing
    (places,) = parts(document, Picture, "By place")
    dots = sum(len(mark.x) for panel in drawn(places).panels for mark in marks(panel, "differs"))
    assert dots == sum(int(p.difference.differs.sum()) for p in comparison.differences.places)
    done = livebode("compare", *paths, "--out", tmp_path / "both")
    assert done.code == 0, done.err
    (lines,) = parts(document, PrintedTable, "Frequency response")
    assert lines.headings[9] == "detectable %"
    seen = comparison.differences.overall.seen
    np.testing.assert_allclose([float(row[9]) for row in lines.rows], 100 * seen, rtol=0.05)
    assert ("smallest detectable change of a line", f"≥ {100 * seen.max():.2g} %") in document.facts  # of all alike
    np.testing.assert_array_equal([line["detectable"] for line in comparison.plain()["lines"]], seen)
    assert {str(tmp_path / "both.html"), str(tmp_path / "both.pdf")} <= set(done.out.split())
    assert "lines of 7 differ" in Page((tmp_path / "both.html").read_text("utf-8")).text
    assert "lines of 7 differ" in " ".join(PdfReader(tmp_path / "both.pdf").pages[0].extract_text().split())
