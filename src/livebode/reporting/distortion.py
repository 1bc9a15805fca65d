"""The section on nonlinear distortion of a run's report."""

from __future__ import annotations

from typing import Any

from livebode.core.document import Paragraph, Part, Section, Table
from livebode.language import marked, number, recognised, tr
from livebode.reporting.report_data import ReportData

_KINDS = {"even": marked("even"), "odd": marked("odd")}


def distortion(of: ReportData) -> Section | None:
    """Even and odd distortion; None where the lines show neither."""
    parts: list[Part] = []
    if levels := of.run.found.get("judged", {}).get("levels"):
        parts += _levels(levels)
    return Section(tr("Distortion"), tuple(parts)) if parts else None


def _levels(levels: dict[str, Any]) -> list[Part]:
    words = tr(
        "Fast method: even distortion appears at even bins, odd distortion at odd bins without excitation. Rms at "
        "these detection lines, relative to the output at a line; mean over {periods} periods.",
        periods=levels["periods"],
    )
    rows = tuple(_row(recognised(word), levels.get(kind)) for kind, word in _KINDS.items())
    headings = (tr("distortion"), "dB", tr("95 % bounds, dB"), tr("noise, dB"), tr("detection lines"))
    return [Paragraph(words), Table(headings, rows, (1, 2, 3, 4))]


def _row(name: str, level: dict[str, Any] | None) -> tuple[str, ...]:
    if level is None:
        return name, tr("not measurable"), "—", "—", "—"
    high, noise, bins = (
        number(level["high_db"], ".1f"),
        number(level["noise_db"], ".1f"),
        str(level["detection_lines"]),
    )
    if level.get("db") is None:
        return name, tr("below {db}", db=high), "—", noise, bins
    return name, number(level["db"], ".1f"), f"{number(level['low_db'], '.1f')} … {high}", noise, bins
