"""The report of a run."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from livebode.analysis import ModelTest
from livebode.configuration import ReportSection
from livebode.core import Document, Paragraph, Section
from livebode.language import tr
from livebode.plugins import loaded, named
from livebode.records import RunRecord
from livebode_reports import first_page, sections
from livebode_reports.acceptance import LimitResult
from livebode_reports.answers import about_answers, answers
from livebode_reports.limits import limits
from livebode_reports.measurement_words import details, distortion, how
from livebode_reports.report_data import ReportData, RunData, entry_title, read, recordings, written
from livebode_reports.verdict import verdict
from livebode_reports.wording import duration

_MEASURED = (
    how, distortion, sections.tracking, sections.parameters, sections.stabilisation, sections.motion, sections.margins,
)  # fmt: skip
_RECORDED = sections.events, sections.validation
_NUMBERS = sections.response, sections.quality
_APPENDIX = (details, sections.source_state, sections.settings, sections.versions)


def run_report(
    directory: Path,
    judged: ModelTest | None = None,
    *,
    made: datetime,
    header: ReportSection | None = None,
    appendix: bool = False,
) -> Document:
    """Build the report of a run.

    The run is read once, in parts. Curves are thinned to 2048 responses; tables and means use all of them.

    Parameters
    ----------
    directory
        Run directory, finished or not.
    judged
        Test of its model on independent data.
    made
        Time of the report, for the title block.
    header
        The first page and the limits. Default: the [report] with which the run was recorded.
    appendix
        Add to the appendix the raw configuration, the versions, and what the report does not contain.

    Raises
    ------
    RecordError, SignalError
        If the directory is not a run, cannot be read, or has no valid response.
    ConfigError
        If the logo cannot be used.
    """
    return accepted_report(directory, judged, made=made, header=header, appendix=appendix)[0]


def accepted_report(
    directory: Path,
    judged: ModelTest | None = None,
    *,
    made: datetime,
    header: ReportSection | None = None,
    appendix: bool = False,
    entry: str | None = None,
) -> tuple[Document, tuple[LimitResult, ...]]:
    """The report of a run, or of an entry of a matrix run, as `run_report`; and the results of the limits."""
    of = read(directory, judged, header, entry)
    return report_of(of, made=made, appendix=appendix), of.accepted


def report_of(of: ReportData, *, made: datetime, appendix: bool = False) -> Document:
    """The report of a run that was read; see `run_report`."""
    parts = [*(make(of) for make in _MEASURED), *_analyses(of.run), *(make(of) for make in _RECORDED)]
    absent = tuple(Paragraph(reason) for reason in parts if isinstance(reason, str))
    there = [limits(of.accepted), *(section for section in parts if isinstance(section, Section))]
    findings, title = verdict(of), " · ".join(filter(None, (of.header.machine or of.title, of.entry)))
    return Document(
        kind=tr("Acceptance report") if of.accepted else tr("Measurement report"),
        title=title,
        facts=first_page.facts(of.header, of.title, facts(of), made),
        verdict=findings,
        sections=tuple(section for section in there if section is not None),
        heading=tr("Findings"),
        foot=" · ".join(filter(None, (title, of.header.serial_number, of.header.company))),
        answers=answers(of),
        about_answers=about_answers(of),
        result=first_page.result(findings, of.accepted, not_judged(of)),
        picture=sections.average(of),
        signatures=first_page.signatures(of.header),
        appendix=(*(make(of) for make in _NUMBERS), *(_appendix(of, absent) if appendix else ())),
        logo=first_page.logo_of(of.header),
        paper=of.header.paper,
        made=made,
    )


def _analyses(run: RunRecord) -> list[Section | str]:
    """The sections of analyses that plug-ins add."""
    makers = [row.section for row in named("analyses").values() if row.section]
    return [loaded(maker)(run.path, run.entry_name) for maker in makers]


def not_judged(of: RunData) -> str:
    """The sentence that replaces the verdict of a run that was not compared with a baseline; empty of another one."""
    if of.run.summary.get("monitoring", {}).get("judged_s"):
        return ""
    return tr("The machine was measured, but not judged: no limits and no baseline were specified.")


def _appendix(of: ReportData, absent: tuple[Paragraph, ...]) -> tuple[Section, ...]:
    sections = record_appendix(of)
    return (*sections, Section(tr("Not in this report"), absent)) if absent else sections


def record_appendix(of: RunData) -> tuple[Section, ...]:
    """Details of the measurement, the complete configuration and the versions."""
    return tuple(section for make in _APPENDIX if (section := make(of)) is not None)


def facts(of: RunData) -> tuple[tuple[str, str], ...]:
    """When it was measured, and how long."""
    source = of.configuration.get("source", {})
    files, first_s = recordings(source), of.extent.spans_s[0]
    measured = first_page.measured_at(of.run, first_s)
    rows = (
        (tr("measured"), measured),
        (tr("recording written"), "" if measured or not files else written(Path(files[-1]))),
        (tr("run written"), "" if measured else written(of.run.path / "run.json")),
        (tr("duration"), duration(of.samples / of.run.lines.rate_hz)),
        (tr("run"), of.run.path.resolve().name),
        (tr("entry"), entry_title(of.run)),
    )
    return tuple((name, value) for name, value in rows if value)
