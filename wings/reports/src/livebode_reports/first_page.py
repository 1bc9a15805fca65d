"""The first page of a report: whose machine, when, the verdict, and who signs."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from livebode.configuration import ReportSection
from livebode.core import Finding, Logo, Tone, date_and_time
from livebode.language import tr
from livebode.records import RunRecord
from livebode_reports.acceptance import Accepted
from livebode_reports.limits import about_limits
from livebode_reports.logo import read_logo

_URGENT: tuple[Tone, ...] = ("fail", "alarm", "differs", "undecided", "pass", "check", "ok", "open")
_MORE = 4  # findings below the verdict; all are on the next page


def trusted(header: ReportSection, directory: Path) -> ReportSection:
    """Without a logo outside of the run's directory: a run from elsewhere may name any file of this computer."""
    if header.logo is None or header.logo.resolve().is_relative_to(directory.resolve()):
        return header
    return header.model_copy(update={"logo": None})


def facts(header: ReportSection, machine: str, rows: Sequence[tuple[str, str]], made: datetime) -> tuple[
    tuple[str, str], ...
]:  # fmt: skip
    """The title block; `rows` are those of the measurement. What is not specified is a dash."""
    always = (
        (tr("machine"), header.machine or machine), (tr("serial number"), header.serial_number or "—"),
        (tr("operator"), header.operator or "—"), *rows,
    )  # fmt: skip
    if_there = (
        (tr("company"), header.company), (tr("customer"), header.customer), (tr("conditions"), header.conditions),
    )  # fmt: skip
    last = (tr("report written"), date_and_time(made.timestamp()))
    return (*always, *((name, value) for name, value in if_there if value), last)


def measured_at(run: RunRecord, first_s: float) -> str:
    """Date, time and zone of the beginning of the measurement; empty where nothing recorded it."""
    unix_s = run.clock.unix_s(first_s)
    if unix_s is None:
        unix_s = (run.summary.get("source") or {}).get("clock_offset_s")
    return "" if unix_s is None else date_and_time(float(unix_s))


def result(findings: Sequence[Finding], accepted: Sequence[Accepted] = (), not_judged: str = "") -> tuple[Finding, ...]:
    """The verdict of the report, and the next findings that a person should see.

    `not_judged` replaces a verdict where only the quality of the measurement is known.
    """
    every = [*about_limits(accepted), *findings]
    first = min(every, key=lambda finding: _URGENT.index(finding.tone))
    if first.tone == "ok" and not_judged:
        first = Finding("open", not_judged)
    urgent = [f for f in every if f.tone not in ("ok", "open") and f is not first]
    return (first, *sorted(urgent, key=lambda finding: _URGENT.index(finding.tone))[:_MORE])


def signatures(header: ReportSection) -> tuple[str, ...]:
    """Who signs, and for whom."""
    measured = header.operator or tr("operator")
    received = header.customer or tr("customer")
    return tuple(tr("{name}: date, signature", name=name) for name in (measured, received))


def logo_of(header: ReportSection) -> Logo | None:
    """The logo; ConfigError if its file cannot be used."""
    if header.logo is None:
        return None
    return read_logo(header.logo, header.company or tr("logo"))
