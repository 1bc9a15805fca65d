"""Figures in a PDF: our backend on ReportLab's canvas, and Matplotlib's own PDF on the pages by pypdf.

`python -m bench.decisions.pdf [DIRECTORY]` draws the same document with both, and keeps the files in the directory.
"""

from __future__ import annotations

import io
import sys
import tempfile
import time
import tracemalloc
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from pypdf import PdfReader, PdfWriter
from pypdf.generic import DecodedStreamObject, DictionaryObject, NameObject, StreamObject

from bench.decisions.former import code_lines
from livebode.core import Lines, Responses
from livebode.core.document import Document, Finding, Paragraph, Picture, Section
from livebode.report import pdf
from livebode.report.style import LIGHT, drawing, quiet_about_letters

OWN = Path("src/livebode/report/pdf_figure.py")
RUNS = 3
WORDS = ("frequency in Hz", "phase in degrees", "u to ω", "Keff", "力矩")


@dataclass(frozen=True)
class Place:
    """A figure on a page, with the matrix that brings it there."""

    page: int
    matrix: tuple[float, ...]
    figure: Figure


def by_pypdf(document: Document, path: Path) -> None:
    """As `save_pdf`, with Matplotlib's own PDF of each figure."""
    places: list[Place] = []

    def place(canvas: Any, figure: Figure) -> None:
        places.append(Place(canvas.getPageNumber(), tuple(canvas._currentMatrix), figure))

    own, pdf.draw_on = pdf.draw_on, place
    try:
        pdf.save_pdf(document, path)
    finally:
        pdf.draw_on = own
    with_figures(path.read_bytes(), places).write(path)


def with_figures(pages: bytes, places: list[Place]) -> PdfWriter:
    """The pages with the figures as forms; to merge the content of pages would parse all numbers of a figure."""
    writer = PdfWriter(clone_from=io.BytesIO(pages))
    for number, place in enumerate(places):
        page, name = writer.pages[place.page - 1], NameObject(f"/Figure{number}")
        forms = page["/Resources"].setdefault(NameObject("/XObject"), DictionaryObject())
        forms.get_object()[name] = writer._add_object(form(place.figure, writer))
        contents = page.get_contents()
        put = f"q {' '.join(f'{value:.6f}' for value in place.matrix)} cm {name} Do Q"
        data = b"q\n" + (contents.get_data() if contents is not None else b"") + b"\nQ\n" + put.encode()
        page[NameObject("/Contents")] = writer._add_object(packed(data))
    return writer


def form(figure: Figure, writer: PdfWriter) -> StreamObject:
    file = io.BytesIO()
    with drawing(LIGHT), matplotlib.rc_context({"pdf.fonttype": 42}), quiet_about_letters():
        figure.savefig(file, format="pdf", dpi=220, metadata={"CreationDate": None})
    page = PdfReader(file).pages[0]
    made = packed(page.get_contents().get_data())
    for name, value in {"/Type": NameObject("/XObject"), "/Subtype": NameObject("/Form"), "/BBox": page.mediabox,
                        "/Resources": page["/Resources"].clone(writer)}.items():  # fmt: skip
        made[NameObject(name)] = value
    return made


def packed(data: bytes) -> StreamObject:
    stream = DecodedStreamObject()
    stream.set_data(data)
    return stream.flate_encode()


def responses(rows: int) -> Responses:
    """Responses of a machine that moves to and fro."""
    rng, lines = np.random.default_rng(1), Lines.parse("20:140:20", rate_hz=4000, window=400)
    x = lines.frequency_hz / 62.0
    true = np.broadcast_to(3 / (1 - x**2 + 0.1j * x), (rows, len(lines)))
    number = 200 * np.arange(rows) + 399
    return Responses(
        lines=lines, value=true * (1 + 0.02 * rng.standard_normal(true.shape)), sigma=0.02 * np.abs(true),
        dof=np.full(rows, 9.0), coherence=np.full(true.shape, 0.99), valid=rng.random(true.shape) < 0.95,
        first=number - 399, sample=number, time_s=number / 4000.0,
        schedule=0.6 + 0.5 * np.abs((np.arange(rows) / 60 + 1) % 2 - 1), unit="rad/s/(N m)",
    )  # fmt: skip


def document(groups: int) -> Document:
    """Text and so many groups of three pictures: a Bode plot, curves over the position, parameters over time."""
    data, time_s = responses(400), np.arange(400) * 0.05
    curve = ("Keff", "N/m", 1e5 * (1 + 0.01 * np.sin(time_s)), np.full(400, 500.0))
    group = (
        Picture("bode", {"responses": data, "names": ("u", "ω")}, "Average"),
        Picture("tracking", {"responses": data, "schedule_name": "力矩"}, "Over time"),
        Picture("parameters", {"time_s": time_s, "curves": [curve]}, "Parameters"),
    )
    sections = tuple(Section(f"Part {i}", (Paragraph("Text."), *group)) for i in range(groups))
    return Document("run", "Report", (("rate", "4 kHz"),), (Finding("ok", "No change."),), sections, "livebode")


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp())
    made = document(1)
    for name, save in {"own backend": pdf.save_pdf, "with pypdf": by_pypdf}.items():
        path, other = folder / f"{name}.pdf", folder / "again.pdf"
        save(made, path)
        took = []
        for _ in range(RUNS):
            began = time.process_time()
            save(made, other)
            took.append(time.process_time() - began)
        tracemalloc.start()
        save(made, other)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        text = "\n".join(page.extract_text() for page in PdfReader(path).pages)
        same, found = other.read_bytes() == path.read_bytes(), [word for word in WORDS if word in text]
        print(f"{name}: {path.stat().st_size / 1e3:.0f} kB, {min(took):.2f} s of the processor, {peak / 1e6:.0f} MB")
        print(f"  same bytes again: {same}, {path.read_bytes().count(b'/FontDescriptor ')} fonts, found: {found}")
    print(f"lines of code of our backend: {code_lines(OWN.read_text(encoding='utf-8'))}; files in {folder}")


if __name__ == "__main__":
    main()
