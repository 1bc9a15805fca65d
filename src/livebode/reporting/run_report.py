"""The report of a run."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from livebode.core.clock import date_and_time, moment
from livebode.core.document import Document, Paragraph, Section
from livebode.language import tr
from livebode.reporting import sections
from livebode.reporting.distortion import distortion
from livebode.reporting.measured import how
from livebode.reporting.report_data import Judged, ReportData, read, recordings, written
from livebode.reporting.verdict import verdict
from livebode.reporting.wording import duration

_SECTIONS = (
    how, sections.response, distortion, sections.tracking, sections.parameters, sections.motion, sections.margins,
    sections.events, sections.quality, sections.validation, sections.settings, sections.versions,
)  # fmt: skip


def run_report(directory: Path, judged: Judged | None = None, *, made: datetime) -> Document:
    """Build the report of a run.

    The run is read once, in parts. Curves are thinned to 2048 responses; tables and means use all of them.

    Parameters
    ----------
    directory
        Run directory, in one piece or in segments, finished or not.
    judged
        Validation of its model on independent data.
    made
        Time of the report, for the title block.

    Raises
    ------
    RecordError, SignalError
        If the directory is not a run, cannot be read, or has no valid response.
    """
    of = read(directory, judged)
    found = [make(of) for make in _SECTIONS]
    absent = tuple(Paragraph(reason) for reason in found if isinstance(reason, str))
    there = [section for section in found if isinstance(section, Section)]
    version = of.run.summary.get("versions", {}).get("livebode", "")
    return Document(
        kind=tr("Report of a run"),
        title=of.title,
        facts=facts(of, made),
        verdict=verdict(of),
        sections=(*there, Section(tr("Not in this report"), absent)) if absent else tuple(there),
        heading=tr("Verdict"),
        foot=f"{of.title} · {of.run.path.resolve().name} · livebode {version}".strip(),
    )


def facts(of: ReportData, made: datetime) -> tuple[tuple[str, str], ...]:
    """The title block."""
    source = of.configuration.get("source", {})
    files, first_s, last_s = recordings(source), *of.of.spans_s
    begun = (of.run.summary.get("source") or {}).get("clock_offset_s")
    rows = (
        (tr("machine"), of.title),
        (tr("source"), str(source.get("url", "")) if "url" in source else _kind(files)),
        (tr("run"), of.run.path.resolve().name),
        (tr("run's clock"), f"{moment(first_s, 2)} … {moment(last_s, 2)}"),
        (tr("started"), date_and_time(float(begun)) if begun is not None else ""),
        (tr("duration"), duration(of.samples / of.run.lines.rate_hz)),
        (tr("recording written"), written(Path(files[-1])) if files else ""),
        (tr("run written"), written(of.run.path / "run.json")),
        (tr("report written"), date_and_time(made.timestamp())),
        ("livebode", str(of.run.summary.get("versions", {}).get("livebode", ""))),
    )
    return tuple((name, value) for name, value in rows if value)


def _kind(files: list[str]) -> str:
    if len(files) > 1:
        return tr("{count} recordings", count=len(files))
    return tr("a recording") if files else ""
