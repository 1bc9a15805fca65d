"""A document as PDF on A4 (extra `pdf`: ReportLab)."""

from __future__ import annotations

import textwrap
from html import escape
from pathlib import Path
from typing import Any

from reportlab.lib.colors import HexColor
from reportlab.lib.enums import TA_RIGHT
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    CondPageBreak,
    Flowable,
    Frame,
    KeepTogether,
    PageTemplate,
    Spacer,
    XPreformatted,
)
from reportlab.platypus import Paragraph as Words
from reportlab.platypus import Table as Grid

from livebode.core.document import Document, Listing, Paragraph, Part, Picture, Section, Table
from livebode.language import recognised
from livebode.report.figures import WIDTH_IN, drawn
from livebode.report.html import readable
from livebode.report.pdf_figure import draw_on, draw_string
from livebode.report.pdf_fonts import BOLD, FIXED, PLAIN, register_fonts, runs, wide_font
from livebode.report.style import LIGHT, columns

_MARGIN = 16 * mm
_WIDTH = A4[0] - 2 * _MARGIN
_HEIGHT_MAX = A4[1] - 90 * mm  # of a picture with its caption below a heading
_TONE = {"ok": "#00734d", "check": "#8a5a00", "alarm": "#b3261e", "differs": "#b3261e", "open": "#5b6775"}
_LETTERS = 105  # of a listing's line
_CELL_LINES = 40  # of a table: a cell cannot continue on another page


def save_pdf(document: Document, path: Path) -> None:
    """Write the document; the same document gives the same bytes.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    register_fonts()
    template = _PdfPages(document, path)
    flow: list[Flowable] = [
        _words(document.kind, _KIND), _words(document.title, _TITLE), _facts(document), Spacer(0, 4 * mm),
        _words(document.heading, _HEADING), _verdict(document),
    ]  # fmt: skip
    for section in document.sections:
        flow += _section(section)
    template.build(flow, canvasmaker=_Numbered)


class _PdfPages(BaseDocTemplate):  # type: ignore[misc]
    def __init__(self, document: Document, path: Path) -> None:
        super().__init__(
            str(path), pagesize=A4, title=readable(f"{document.title}: {document.kind}"), author="livebode",
            invariant=1, pageCompression=1,
        )  # fmt: skip
        frame = Frame(_MARGIN, 18 * mm, _WIDTH, A4[1] - 34 * mm, 0, 0, 0, 0)
        foot = readable(document.foot)[:140]
        self.addPageTemplates(PageTemplate(frames=[frame], onPage=lambda canvas, _: _foot(canvas, foot)))
        self._sections = 0

    def afterFlowable(self, flowable: Flowable) -> None:  # noqa: N802
        """Add each heading to the outline."""
        if isinstance(flowable, Words) and flowable.style.name == "heading":
            name = f"section {self._sections}"
            self._sections += 1
            self.canv.bookmarkPage(name)
            self.canv.addOutlineEntry(flowable.getPlainText(), name)


class _Numbered(Canvas):  # type: ignore[misc]
    """Pages with their total number, which is known only at the end."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._kept: list[dict[str, Any]] = []

    def showPage(self) -> None:  # noqa: N802
        self._kept.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        for number, page in enumerate(self._kept, 1):
            self.__dict__.update(page)
            self.setFont(PLAIN, 7.5)
            self.setFillColor(HexColor(LIGHT.muted))
            self.drawRightString(A4[0] - _MARGIN, 10 * mm, f"{number} / {len(self._kept)}")
            super().showPage()
        super().save()


def _foot(canvas: Canvas, text: str) -> None:
    canvas.setFillColor(HexColor(LIGHT.muted))
    draw_string(canvas, 10 * mm, text, PLAIN, 7.5, x=_MARGIN)


class _Drawing(Flowable):  # type: ignore[misc]
    """A figure as wide as the page, or as its height permits."""

    def __init__(self, picture: Picture) -> None:
        super().__init__()
        self._figure = drawn(picture)
        width_in, height_in = self._figure.get_size_inches()
        self._scale = min(_WIDTH / (72 * max(width_in, WIDTH_IN)), _HEIGHT_MAX / (72 * height_in))
        self.width, self.height = 72 * width_in * self._scale, 72 * height_in * self._scale

    def draw(self) -> None:
        self.canv.saveState()
        self.canv.scale(self._scale, self._scale)
        draw_on(self.canv, self._figure)
        self.canv.restoreState()


class _Kept(KeepTogether):  # type: ignore[misc]
    """A picture with its caption and their height."""

    def __init__(self, picture: Picture) -> None:
        figure = _Drawing(picture)
        self.room = figure.height + 12 * mm
        super().__init__([figure, _words(picture.caption, _NOTE)])


def _style(name: str, size: float, **more: Any) -> ParagraphStyle:
    more = {"fontName": PLAIN, "leading": 1.38 * size, "textColor": HexColor(LIGHT.ink), "splitLongWords": 1} | more
    return ParagraphStyle(name, fontSize=size, **more)


_MUTED = HexColor(LIGHT.muted)
_KIND = _style("kind", 9, textColor=_MUTED)
_TITLE = _style("title", 18, fontName=BOLD, spaceAfter=6)
_HEADING = _style("heading", 12, fontName=BOLD, spaceBefore=12, spaceAfter=4)
_BODY = _style("body", 9, spaceAfter=4)
_NOTE = _style("note", 7.5, textColor=_MUTED, spaceBefore=2, spaceAfter=6)
_CELLS = _style("cell", 7.5)
_NUMBER = _style("number", 7.5, alignment=TA_RIGHT)
_HEAD = _style("head", 7.5, fontName=BOLD)
_HEAD_NUMBER = _style("head number", 7.5, fontName=BOLD, alignment=TA_RIGHT)
_NAME = _style("name", 7.5, textColor=_MUTED)
_CODE = _style("code", 7, fontName=FIXED, leading=9)


def _words(text: str, style: ParagraphStyle) -> Words:
    # Paragraphs have a markup language; text from data must remain plain text.
    parts = [(escape(run, quote=False), wide) for run, wide in runs(readable(text))]
    if any(wide for _, wide in parts):
        style = style.clone(style.name, wordWrap="CJK")
    return Words("".join(f'<font name="{wide_font()}">{run}</font>' if wide else run for run, wide in parts), style)


def _cell(text: str, style: ParagraphStyle, width: float) -> Words:
    letters = int(_CELL_LINES * width / (0.65 * style.fontSize))
    return _words(text if len(text) <= letters else f"{text[:letters]} …", style)


def _facts(document: Document) -> Grid:
    half = -(-len(document.facts) // 2)
    widths = [0.14 * _WIDTH, 0.36 * _WIDTH]
    cells = [[_cell(name, _NAME, widths[0]), _cell(value, _CELLS, widths[1])] for name, value in document.facts]
    blank = [_words("", _NAME), _words("", _CELLS)]
    left, right = cells[:half], cells[half:] + [blank] * (2 * half - len(cells))
    rows = [a + b for a, b in zip(left, right)]
    return Grid(rows, colWidths=widths * 2, style=_LINES, hAlign="LEFT")


def _verdict(document: Document) -> Grid:
    rows, widths = [], [0.16 * _WIDTH, 0.84 * _WIDTH]
    for finding in document.verdict:
        tone = _style("tone", 8, fontName=BOLD, textColor=HexColor(_TONE[finding.tone]))
        rows.append([_words(recognised(document.tones[finding.tone]), tone), _cell(finding.text, _BODY, widths[1])])
    return Grid(rows, colWidths=widths, style=_LINES, hAlign="LEFT")


_LINES = [
    ("VALIGN", (0, 0), (-1, -1), "TOP"),
    ("LINEBELOW", (0, 0), (-1, -1), 0.4, HexColor(LIGHT.grid)),
    ("LEFTPADDING", (0, 0), (-1, -1), 0),
    ("RIGHTPADDING", (0, 0), (-1, -1), 5),
    ("TOPPADDING", (0, 0), (-1, -1), 1.5),
    ("BOTTOMPADDING", (0, 0), (-1, -1), 2.5),
]


def _section(section: Section) -> list[Flowable]:
    flow = [flowable for part in section.parts for flowable in _part(part)]
    # A heading stays with the beginning of its content on the same page.
    begins = section.parts[0] if section.parts else None
    room = flow[0].room if isinstance(begins, Picture) else 30 * mm
    return [CondPageBreak(room + 18 * mm), _words(section.title, _HEADING), *flow]


def _part(part: Part) -> list[Flowable]:
    if isinstance(part, Paragraph):
        return [_words(part.text, _BODY)]
    if isinstance(part, Listing):
        lines = [piece for line in readable(part.text).split("\n") for piece in textwrap.wrap(line, _LETTERS) or [""]]
        return [XPreformatted(escape("\n".join(lines), quote=False), _CODE), Spacer(0, 2 * mm)]
    if isinstance(part, Picture):
        return [_Kept(part)]
    return _table(part)


def _table(table: Table) -> list[Flowable]:
    widths, titled = _widths(table), any(table.headings)

    def row(texts: tuple[str, ...], style: ParagraphStyle, number: ParagraphStyle) -> list[Words]:
        return [_cell(t, number if i in table.numbers else style, widths[i]) for i, t in enumerate(texts)]

    rows = [row(table.headings, _HEAD, _HEAD_NUMBER)] if titled else []
    rows += [row(texts, _CELLS, _NUMBER) for texts in table.rows]
    if not titled:
        for cells, texts in zip(rows, table.rows):
            cells[0] = _cell(texts[0], _NAME, widths[0])
    if not rows:  # a grid has at least one row
        return []
    ruled = [*_LINES, ("LINEBELOW", (0, 0), (-1, 0), 0.8, _MUTED)] if titled else _LINES
    grid = Grid(rows, colWidths=widths, style=ruled, repeatRows=int(titled), splitInRow=1, hAlign="LEFT")
    return [grid, _words(table.note, _NOTE) if table.note else Spacer(0, 3 * mm)]


def _widths(table: Table) -> list[float]:
    """Columns as wide as their texts, limited by the page."""
    if not any(table.headings):
        return [0.24 * _WIDTH, 0.76 * _WIDTH]
    every = [table.headings, *table.rows]
    letters = [min(max(columns(texts[i]) for texts in every), 60) + 2 for i in range(len(table.headings))]
    return [_WIDTH * max(n, 6) / sum(max(m, 6) for m in letters) for n in letters]
