"""The report of a whole matrix run."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from livebode.analysis import Accepted, ModelTest
from livebode.configuration import ReportSection
from livebode.core import Document, Paragraph, Section
from livebode.language import tr
from livebode.reporting import first_page, matrix_sections, sections
from livebode.reporting.matrix_data import read_matrix
from livebode.reporting.run_report import facts, not_judged, record_appendix
from livebode.reporting.verdict import about_record, by_urgency


def matrix_report(
    directory: Path,
    judged: ModelTest | None = None,  # noqa: ARG001 - a matrix has no model
    *,
    made: datetime,
    header: ReportSection | None = None,
    appendix: bool = False,
    entry: str | None = None,  # noqa: ARG001 - the report of an entry is that of a response
) -> tuple[Document, tuple[Accepted, ...]]:
    """Build the report of a matrix run: the matrix of Bode plots, singular values, and its entries.

    Models, margins and limits belong to one response, so they are in the report of an entry. Arguments are those of
    `accepted_report`.

    Raises
    ------
    RecordError, SignalError
        As `read_matrix`.
    ConfigError
        If the logo cannot be used.
    """
    of = read_matrix(directory, header)
    findings = by_urgency(
        [*about_record(of), *matrix_sections.about_columns(of.newest), matrix_sections.about_responses(of)]
    )
    title = of.header.machine or of.title
    parts: list[Section] = [
        matrix_sections.how(of), matrix_sections.bode(of), matrix_sections.entries(of), matrix_sections.inputs(of),
        sections.events(of), sections.quality(of),
    ]  # fmt: skip
    if of.header.limits:
        words = tr("Limits apply to one response: they are judged in the report of an entry.")
        parts.insert(0, Section(tr("Limits"), (Paragraph(words),)))
    document = Document(
        kind=tr("Measurement report"),
        title=title,
        facts=first_page.facts(of.header, of.title, facts(of), made),
        verdict=findings,
        sections=tuple(parts),
        heading=tr("Findings"),
        foot=" · ".join(filter(None, (title, of.header.serial_number, of.header.company))),
        result=first_page.result(findings, (), not_judged(of)),
        picture=matrix_sections.singular_values(of),
        signatures=first_page.signatures(of.header),
        appendix=record_appendix(of) if appendix else (),
        logo=first_page.logo_of(of.header),
        paper=of.header.paper,
        made=made,
    )
    return document, ()
