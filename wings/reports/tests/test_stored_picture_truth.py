"""The stabilisation chart of a run is in its report as `fit` has drawn it, and only if livebode has drawn it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

from livebode_reports.html import to_html
from livebode_reports.run_report import run_report
from livebode_reports.svg import pictures_svg
from tests.support.command import livebode
from tests.support.drawn_svg import checked, paths_of
from tests.support.reports import Page, measured, write_run

MADE = datetime(2026, 11, 21, 12, tzinfo=UTC)
TITLE = "Stabilisation chart"
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{}</svg>'
FOREIGN = {
    "a script": SVG.format("<script>alert(1)</script>"),
    "another page": SVG.format('<foreignObject><p xmlns="http://www.w3.org/1999/xhtml">x</p></foreignObject>'),
    "text of a page": SVG.format('<p xmlns="http://www.w3.org/1999/xhtml">x</p>'),
    "an action": SVG.format('<rect width="1" height="1" onclick="alert(1)"/>'),
    "another file": SVG.format('<image href="http://evil.example/x.png"/>'),
    "a colour elsewhere": SVG.format('<rect width="1" height="1" fill="url(http://evil.example/x)"/>'),
    "a style": SVG.format('<rect width="1" height="1" style="position:fixed"/>'),
    "rules within": SVG.format("<svg><style>body{display:none}</style></svg>"),
    "half a file": SVG.format("<rect")[:60],
    "too many bytes": SVG.format(f"<text>{'a' * (1 << 20)}</text>"),
}


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return write_run(tmp_path / "run", measured(40, 5))


def titles(run: Path) -> list[str]:
    document = run_report(run, made=MADE, appendix=True)
    return [section.title for section in (*document.sections, *document.appendix)]


def test_the_chart_is_in_the_page_and_on_paper_as_it_was_drawn(run: Path) -> None:
    assert TITLE not in titles(run)
    fitted = livebode("fit", run, "--model", "modal", "--order", 1)
    assert fitted.code == 0, fitted.err
    file = checked((run / "stabilisation.svg").read_text(encoding="utf-8"))

    document = run_report(run, made=MADE)
    (section,) = (section for section in document.sections if section.title == TITLE)
    (picture,) = section.parts
    chart = pictures_svg(document)[document.pictures.index(picture)]
    found = checked(chart)
    for name in ("stable", "other", "magnitude", "mode"):
        (expected, drawn) = (paths_of(root, name) for root in (file, found))
        assert len(drawn) == len(expected), name
        for (_, here), (_, there) in zip(drawn, expected):
            assert all(map(np.array_equal, here, there)), name
    assert found.get("class") == "figure"  # by which the rules of the page are those of the picture
    assert "style" not in chart

    assert livebode("report", run).code == 0
    page = Page((run / "report.html").read_text(encoding="utf-8"))
    assert "order of the model (number of poles)" in page.text
    text = " ".join(part.extract_text() for part in PdfReader(run / "report.pdf").pages)
    assert "order of the model (number of poles)" in " ".join(text.split())


@pytest.mark.parametrize("name", FOREIGN)
def test_what_livebode_has_not_drawn_is_not_in_the_report(run: Path, name: str) -> None:
    (run / "stabilisation.svg").write_text(FOREIGN[name], encoding="utf-8")
    assert TITLE not in titles(run)
    page = to_html(run_report(run, made=MADE, appendix=True))
    assert "evil" not in page
    assert "No stabilisation chart: the file in the run&#x27;s directory was changed." in page
