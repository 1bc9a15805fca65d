"""The PDF of a report by Typst: size, processor time, same bytes, text and tags.

`python -m bench.decisions.pdf [DIRECTORY]` keeps the files in the directory.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from pypdf import PdfReader

from livebode.core import Document, Finding, Lines, Paragraph, Picture, Responses, Section
from livebode_reports import pdf
from livebode_reports.svg import pictures_svg

RUNS = 3
WORDS = ("frequency in Hz", "phase in degrees", "u to ω", "Keff", "力矩")


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
    made, path, other = document(1), folder / "typst.pdf", folder / "again.pdf"
    drawn = pictures_svg(made)
    pdf.save_pdf(made, path, drawn)
    took = []
    for _ in range(RUNS):
        began = time.process_time()
        pdf.save_pdf(made, other, drawn)
        took.append(time.process_time() - began)
    reader = PdfReader(path)
    text, root = "\n".join(page.extract_text() for page in reader.pages), reader.root_object
    same, found = other.read_bytes() == path.read_bytes(), [word for word in WORDS if word in text]
    print(f"{path.stat().st_size / 1e3:.0f} kB, {min(took):.2f} s of the processor without drawing; in {folder}")
    print(f"same bytes again: {same}, found: {found}, tagged: {'/StructTreeRoot' in root}, language: {root['/Lang']}")


if __name__ == "__main__":
    main()
