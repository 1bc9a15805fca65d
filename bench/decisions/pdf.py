"""Figures in a PDF: Matplotlib's own PDF merged by pypdf, and the former backend on ReportLab's canvas.

`python -m bench.decisions.pdf [DIRECTORY]` draws the same document with both, and keeps the files in the directory.
"""

from __future__ import annotations

import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pypdf import PdfReader

from bench.decisions.former import code_lines, module, source
from livebode.core import Lines, Responses
from livebode.core.document import Document, Finding, Paragraph, Picture, Section
from livebode.report.pdf import save_pdf

FIGURE, PAGES = "src/livebode/report/pdf_figure.py", "src/livebode/report/pdf.py"
RUNS = 3


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


def document(pictures: int) -> Document:
    """Text and so many groups of three pictures: a Bode plot, curves over the position, parameters over time."""
    data, time_s = responses(400), np.arange(400) * 0.05
    curve = ("Keff", "N/m", 1e5 * (1 + 0.01 * np.sin(time_s)), np.full(400, 500.0))
    group = (
        Picture("bode", {"responses": data, "names": ("u", "ω")}, "Average"),
        Picture("tracking", {"responses": data, "schedule_name": "x"}, "Over time"),
        Picture("parameters", {"time_s": time_s, "curves": [curve]}, "Parameters"),
    )
    sections = tuple(Section(f"Part {i}", (Paragraph("Text."), *group)) for i in range(pictures))
    return Document("run", "Report", (("rate", "4 kHz"),), (Finding("ok", "No change."),), sections, "livebode")


def former() -> Callable[[Document, Path], None]:
    """`save_pdf` as it was, with the figures on ReportLab's canvas."""
    figure = module(FIGURE)
    text = source(PAGES).replace("from livebode.report.pdf_figure import", f"from {figure.__name__} import")
    return module(PAGES, text).save_pdf


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp())
    for groups in (1, 3):
        print(f"{3 * groups} figures")
        made = document(groups)
        for name, save in {"former": former(), "merged": save_pdf}.items():
            path, other = folder / f"{name}{groups}.pdf", folder / "again.pdf"
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
            words = [word for word in ("frequency in Hz", "phase in degrees", "u to ω", "Keff") if word in text]
            fonts, same = path.read_bytes().count(b"/FontDescriptor "), other.read_bytes() == path.read_bytes()
            print(f"  {name}: {path.stat().st_size / 1e3:6.1f} kB, {min(took):5.2f} s of the processor, "
                  f"{peak / 1e6:5.1f} MB peak, {fonts} fonts, same bytes again: {same}, found: {words}")  # fmt: skip
    now = Path(FIGURE).read_text(encoding="utf-8")
    print(f"lines of code: {code_lines(source(FIGURE))} former, {code_lines(now)} now; files in {folder}")


if __name__ == "__main__":
    main()
