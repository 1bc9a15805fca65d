"""The report of a whole matrix run: its data, read once from its directory, and its sections."""

from __future__ import annotations

from datetime import datetime
from math import inf, isfinite
from pathlib import Path

import numpy as np

from livebode.analysis import ModelTest, newest_average
from livebode.configuration import ReportSection, recorded_configuration, recorded_report
from livebode.core import (
    REASONS,
    Document,
    Finding,
    Listing,
    MatrixResponses,
    Paragraph,
    Part,
    Picture,
    PrintedTable,
    Responses,
    Section,
    SignalError,
    moment,
    with_bound,
)
from livebode.dataclass import dataclass
from livebode.language import number, tr, trn, worded
from livebode.records import RunRecord
from livebode_reports import first_page, sections
from livebode_reports.acceptance import LimitResult
from livebode_reports.events import EventSummary
from livebode_reports.measurement_words import about_bounds, grid_rows, matrix_in_words, signal_rows
from livebode_reports.report_data import Extent, RunData
from livebode_reports.run_report import facts, not_judged, record_appendix
from livebode_reports.verdict import about_record, by_urgency, of_measurement
from livebode_reports.wording import line_table, lines_of, pairs, polar, share


@dataclass(frozen=True, eq=False, kw_only=True)
class MatrixReportData(RunData):
    """The data of a matrix run.

    Attributes
    ----------
    newest
        The newest matrix with a valid column, as one row; with tracking.average it is from all repetitions.
    """

    newest: MatrixResponses


def read_matrix(directory: Path, header: ReportSection | None = None) -> MatrixReportData:
    """Read a matrix run in parts; `header` replaces the [report] with which it was recorded.

    Raises
    ------
    RecordError, SignalError
        If the directory is not a matrix run, cannot be read, or has no valid column.
    """
    run = RunRecord.open(directory, matrix=True)
    newest: MatrixResponses | None = None
    count, incomplete, begin_s, end_s = 0, 0, inf, -inf
    for part in run.undamaged(run.matrix_batches()):
        valid = part.valid.any(axis=(1, 2))
        count += len(part)
        incomplete += int(np.count_nonzero(~part.valid.all(axis=(1, 2))))
        if valid.any():
            newest = part.newest()
            begin_s = min(begin_s, float(part.time_s[valid].min()))
            end_s = max(end_s, float(part.time_s[valid].max()))
    if newest is None:
        raise SignalError(
            "no-valid-response",
            "none of the matrices has a valid column at any line",
            "compare [experiments] with the recording: dwell_periods, settle_periods, start",
        )
    return MatrixReportData(
        run=run,
        configuration=recorded_configuration(run.summary),
        extent=Extent(count, incomplete, (begin_s, end_s), int(newest.sample[0])),
        event_summary=EventSummary.of(run.each_event_and_damage()),
        header=recorded_report(run.summary) if header is None else header,
        newest=newest_average(run, newest),
    )


_ACROSS, _DOWN = 3, 3  # Bode plots in one picture; more are illegible on a page


def singular_values(of: MatrixReportData) -> Picture:
    """The picture of the first page."""
    caption = tr(
        "Singular values of the newest matrix, with 95 % bounds: largest and smallest gain over all directions of "
        "the inputs."
    )
    return Picture("singular values", {"responses": of.newest}, caption)


def how(of: MatrixReportData) -> Section:
    """How it was measured."""
    facts = of.run.found["experiments"]
    experiments = trn(
        "{n} experiment of {dwell} periods, the first {settle} of them unused",
        "{n} experiments, each of {dwell} periods, the first {settle} of them unused",
        facts["number"], dwell=facts["dwell_periods"], settle=facts["settle_periods"],
    )  # fmt: skip
    repetitions = tr("the newest matrix")
    if of.configuration.get("tracking", {}).get("average"):
        repetitions = tr("average over all repetitions so far, at most {count}", count=facts["memory"])
    rows = [
        *signal_rows(of), *grid_rows(of), (tr("experiments"), experiments), (tr("each matrix"), repetitions),
    ]  # fmt: skip
    return Section(tr("How it was measured"), (Paragraph(matrix_in_words(of)), pairs(rows), Paragraph(about_bounds())))


def bode(of: MatrixReportData) -> Section:
    """The matrix of Bode plots, in pictures of a size that a page can show."""
    newest, parts = of.newest, list[Part]()
    for o in range(0, len(newest.outputs), _DOWN):
        for i in range(0, len(newest.inputs), _ACROSS):
            block = newest.sel(output=newest.outputs[o : o + _DOWN], input=newest.inputs[i : i + _ACROSS])
            caption = tr(
                "Bode plots of the newest matrix, at {time}: outputs down, inputs across, each entry with the bound "
                "that covers it alone with 95 %.",
                time=moment(float(newest.time_s[0]), 2),
            )
            parts.append(Picture("matrix", {"responses": block}, caption))
    return Section(tr("Matrix of Bode plots"), tuple(parts))


def entries(of: MatrixReportData) -> Section:
    """What is known of each entry."""
    newest = of.newest
    rows = [
        _entry_row(newest.entry(o, i), f"{o} ← {i}", newest.reason[0, :, newest.inputs.index(i)])
        for o in newest.outputs
        for i in newest.inputs
    ]
    note = tr(
        "± covers the true value with 95 %. Largest bound: relative to |G| at its line. Coherence: the multiple "
        "coherence of the output with all inputs, at its worst line."
    )
    headings = (
        tr("output ← input"), tr("unit"), tr("valid"), tr("largest |G|, dB"), tr("± dB"), tr("at Hz"),
        tr("largest bound, %"), tr("at Hz"), tr("least coherence γ²"),
    )  # fmt: skip
    table = PrintedTable(headings, tuple(rows), (2, 3, 4, 5, 6, 7, 8), note)
    commands = "\n".join(f"livebode report {of.run.path.name} --entry {name}" for name in of.run.entries)
    more = tr("The report of one entry has its lines, its coherence, a fitted model and limits:")
    return Section(tr("Entries"), (table, Paragraph(more), Listing(commands)))


def _entry_row(response: Responses, name: str, reason: np.ndarray) -> tuple[str, ...]:
    valid, f = response.valid[0], response.lines.frequency_hz
    counted = tr("{count} of {all}", count=int(valid.sum()), all=valid.size)
    if not valid.any():
        why = ", ".join(sorted({worded(REASONS[code]) for code in reason if code}))
        return (name, response.unit, f"{counted}: {why}", "—", "—", "—", "—", "—", "—")
    size, bound = (
        np.where(valid, np.abs(response.value[0]), np.nan),
        np.where(valid, response.bound()[0], np.nan),
    )
    index = int(np.nanargmax(size))
    db, around, _, _ = polar(complex(response.value[0, index]), float(bound[index]))
    relative, coherence = bound / size, np.where(valid, response.coherence[0], np.nan)
    widest, where = "—", "—"
    if np.isfinite(relative).any():
        worst = int(np.nanargmax(relative))
        widest, where = number(100 * relative[worst], ".2g"), number(f[worst], "g")
    least = float(np.nanmin(coherence)) if np.isfinite(coherence).any() else float("nan")
    return (
        name, response.unit, counted, db, around, number(f[index], "g"), widest, where,
        number(least, ".4f") if isfinite(least) else "—",
    )  # fmt: skip


def inputs(of: MatrixReportData) -> Section:
    """Condition number of the inputs and singular values at each line."""
    newest = of.newest
    words = tr(
        "The condition number says how well the experiments separate the inputs: 1 if they are orthogonal; the larger "
        "it is, the more the inputs move together, and the wider are the bounds."
    )
    parts: list[Part] = [Paragraph(words)]
    parts += [Paragraph(f"{worded(sentence)}.") for sentence in newest.why(0)]
    sizes, radius = newest.singular_values[0], newest.singular_value_bound()[0]
    several = sizes.shape[1] > 1
    rows = [
        (
            number(f, "g"), number(condition, ".3g") if isfinite(condition) else "—",
            *with_bound(float(size[0]), float(around[0])),
            *(with_bound(float(size[-1]), float(around[-1])) if several else ()),
        )
        for f, condition, size, around in zip(newest.frequency_hz, newest.condition[0], sizes, radius)
    ]  # fmt: skip
    headings: tuple[str, ...] = ("Hz", tr("condition number of the inputs"), tr("largest singular value"), "±")
    headings += (tr("smallest singular value"), "±") if several else ()
    return Section(tr("Inputs and singular values"), (*parts, line_table(headings, rows)))


def about_columns(newest: MatrixResponses) -> list[Finding]:
    """Findings about the validity of the newest matrix and the separation of the inputs."""
    count, size = newest.value.shape[2] * newest.value.shape[3], lines_of(len(newest.lines))
    wrong = [Finding("check", f"{worded(sentence)}.") for sentence in newest.why(0)]
    findings = wrong or [
        Finding("ok", tr("All {count} entries of the newest matrix are valid at {lines}.", count=count, lines=size))
    ]
    known = np.where(np.isfinite(newest.condition[0]), newest.condition[0], -1.0)
    index = int(known.argmax())
    together = np.any(newest.reason == REASONS.index("not separated"))
    if known[index] >= 0 and not together:
        text = tr(
            "The experiments separate the inputs: condition number at most {worst:.3g} (at {at:g} Hz).",
            worst=float(known[index]), at=float(newest.frequency_hz[index]),
        )  # fmt: skip
        findings.append(Finding("ok", text))
    return findings


def about_responses(of: MatrixReportData) -> Finding:
    """How many matrices there are."""
    extent = of.extent
    text = trn(
        "{n:,} matrix of {entries} responses; {bad:,} ({share}) with an invalid column.",
        "{n:,} matrices of {entries} responses; {bad:,} of them ({share}) have an invalid column (those before the "
        "last experiment of the first repetition are always invalid).",
        extent.count, entries=len(of.run.entries), bad=extent.incomplete, share=share(extent.incomplete, extent.count),
    )  # fmt: skip
    return Finding("ok", text)


def matrix_report(
    directory: Path,
    judged: ModelTest | None = None,  # noqa: ARG001 - a matrix has no model
    *,
    made: datetime,
    header: ReportSection | None = None,
    appendix: bool = False,
    entry: str | None = None,  # noqa: ARG001 - the report of an entry is that of a response
) -> tuple[Document, tuple[LimitResult, ...]]:
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
    findings = by_urgency([*about_record(of), *of_measurement(about_columns(of.newest), [about_responses(of)])])
    title = of.header.machine or of.title
    parts: list[Section] = [
        how(of), bode(of), entries(of), inputs(of),
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
        picture=singular_values(of),
        signatures=first_page.signatures(of.header),
        appendix=record_appendix(of) if appendix else (),
        logo=first_page.logo_of(of.header),
        paper=of.header.paper,
        made=made,
    )
    return document, ()
