"""The section of a run's report on nonlinear distortion and on the scatter between recordings."""

from __future__ import annotations

from typing import Any

from livebode.core import Paragraph, Part, PrintedTable, Section
from livebode.language import Message, number, tr, worded
from livebode_reports.report_data import ReportData

_KINDS = {"even": Message("even"), "odd": Message("odd")}
_LINES_SHOWN = 60


def distortion(of: ReportData) -> Section | None:
    """Even and odd distortion, and the scatter between several recordings; None for one that shows no distortion."""
    parts: list[Part] = []
    if levels := of.run.found.get("judged", {}).get("levels"):
        parts += _levels(levels)
    if between := of.run.summary.get("between"):
        parts += _between(of, between)
    return Section(tr("Distortion"), tuple(parts)) if parts else None


def _between(of: ReportData, between: dict[str, Any]) -> list[Part]:
    level, noise = (_db(between.get(name)) for name in ("distortion_db", "noise_db"))
    words = tr("Same excitation: the response is the mean of {count} recordings.", count=between["recordings"])
    if between["realisations"]:
        words = tr(
            "Robust method: the response is the best linear approximation over {count} realisations of the excitation.",
            count=between["recordings"],
        )
    words += " " + tr(
        "Scatter between them beyond noise {level}, noise of the mean {noise}, relative to the output at a line.",
        level=level, noise=noise,
    )  # fmt: skip
    if not between["differs"]:
        words += " " + tr("Noise explains the scatter.")
    return [Paragraph(words), _standard_deviations(of, between)]


def _standard_deviations(of: ReportData, between: dict[str, Any]) -> PrintedTable:
    columns = [between[name] for name in ("noise_sigma", "total_sigma", "distortion")]
    rows = [
        (number(f, "g"), *("—" if value is None else number(100 * value / abs(size), ".2g") for value in values))
        for f, size, *values in zip(of.run.lines.frequency_hz, of.of.response.value, *columns)
    ]
    step = -(-len(rows) // _LINES_SHOWN)
    note = tr("Standard deviations in % of the response. One recording: the part beyond its noise.")
    headings = ("Hz", tr("mean, noise"), tr("mean, total"), tr("one recording"))
    return PrintedTable(headings, tuple(rows[::step]), (0, 1, 2, 3), note)


def _db(level: float | None) -> str:
    return tr("not known") if level is None else f"{number(level, '.1f')} dB"


def _levels(levels: dict[str, Any]) -> list[Part]:
    words = tr(
        "Fast method: even distortion appears at even bins, odd distortion at odd bins without excitation. Rms at "
        "these detection lines, relative to the output at a line; mean over {periods} periods.",
        periods=levels["periods"],
    )
    rows = tuple(_row(worded(word), levels.get(kind)) for kind, word in _KINDS.items())
    headings = (tr("distortion"), "dB", tr("95 % bounds, dB"), tr("noise, dB"), tr("detection lines"))
    return [Paragraph(words), PrintedTable(headings, rows, (1, 2, 3, 4))]


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
