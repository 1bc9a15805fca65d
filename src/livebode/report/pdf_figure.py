"""Figures as vectors and text on the pages of a PDF: Matplotlib draws them, pypdf puts them there.

ReportLab accepts neither SVG nor pages of another PDF, so its pages have free places for the figures.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import matplotlib
from pypdf import PdfReader, PdfWriter
from pypdf.generic import DecodedStreamObject, DictionaryObject, NameObject, StreamObject
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

from livebode.report.style import LIGHT, drawing, quiet_about_letters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLAIN, BOLD, FIXED = "DejaVuSans", "DejaVuSans-Bold", "DejaVuSansMono"
_RASTER_DPI = 220  # of maps, whose cells are pixels in any case
_SETTINGS: Any = {"pdf.fonttype": 42}  # TrueType, as the text of the pages: Type 3 has no hinting
_NO_DATE = {"CreationDate": None}  # the same figure gives the same bytes


@dataclass(frozen=True)
class Place:
    """Where a figure is on a page: number from 1, lower left corner in points, and scale."""

    page: int
    x: float
    y: float
    scale: float
    figure: Figure


def register_fonts() -> None:
    """Register Matplotlib's fonts, which contain the required symbols, with ReportLab."""
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    for name in (PLAIN, BOLD, FIXED):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, folder / f"{name}.ttf"))


def with_figures(pages: bytes, places: Sequence[Place]) -> PdfWriter:
    """The PDF with these figures at their places."""
    writer = PdfWriter(clone_from=io.BytesIO(pages))
    for number, place in enumerate(places):
        page, name = writer.pages[place.page - 1], NameObject(f"/Figure{number}")
        resources = cast(DictionaryObject, page["/Resources"].get_object())
        forms = resources.setdefault(NameObject("/XObject"), DictionaryObject())
        forms.get_object()[name] = writer._add_object(_form(_as_pdf(place.figure), writer))
        contents = page.get_contents()
        put = f"q {place.scale:.6f} 0 0 {place.scale:.6f} {place.x:.3f} {place.y:.3f} cm {name} Do Q"
        data = b"q\n" + (contents.get_data() if contents is not None else b"") + b"\nQ\n" + put.encode()
        page[NameObject("/Contents")] = writer._add_object(_packed(data))
    return writer


def _form(pdf: bytes, writer: PdfWriter) -> StreamObject:
    """The first page as a form: content with its own resources, which pages can show at any place.

    `PageObject.merge_transformed_page` parses and writes each number of the figure, which takes twice as long.
    """
    page = PdfReader(io.BytesIO(pdf)).pages[0]
    contents = page.get_contents()
    form = _packed(contents.get_data() if contents is not None else b"")
    form.update(
        {
            NameObject("/Type"): NameObject("/XObject"),
            NameObject("/Subtype"): NameObject("/Form"),
            NameObject("/BBox"): page.mediabox,
            NameObject("/Resources"): page["/Resources"].clone(writer),
        }
    )
    return form


def _packed(data: bytes) -> StreamObject:
    stream = DecodedStreamObject()
    stream.set_data(data)
    return stream.flate_encode()


def _as_pdf(figure: Figure) -> bytes:
    file = io.BytesIO()
    with drawing(LIGHT), matplotlib.rc_context(_SETTINGS), quiet_about_letters():
        figure.savefig(file, format="pdf", dpi=_RASTER_DPI, metadata=_NO_DATE)
    return file.getvalue()
