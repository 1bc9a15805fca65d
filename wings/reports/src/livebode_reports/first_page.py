"""The first page of a report: whose machine, when, the verdict, and who signs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from livebode.configuration import ReportSection
from livebode.core import ConfigError, Finding, Logo, Tone, date_and_time
from livebode.language import tr
from livebode.records import RunRecord
from livebode_reports.acceptance import LimitResult
from livebode_reports.limits import about_limits

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


def result(
    findings: Sequence[Finding], accepted: Sequence[LimitResult] = (), not_judged: str = ""
) -> tuple[Finding, ...]:
    """The verdict of the report, and the next findings that a person should see.

    A verdict is about the machine; what is doubtful of the measurement is below it. `not_judged` replaces the verdict
    where nothing was specified by which the machine could be judged.
    """
    every = [*about_limits(accepted), *findings]
    about_machine = [finding for finding in every if finding.subject == "machine"]
    first = min(about_machine, key=lambda finding: _URGENT.index(finding.tone), default=Finding("open", not_judged))
    if first.tone in ("ok", "open") and not_judged:
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


BYTES_MAX = 1 << 20
_PIXELS_MAX = 4000
# Nothing that names another file, executes, or grows when it is parsed.
_ACTIVE = re.compile(
    rb"<!DOCTYPE|<!ENTITY|<script|<foreignObject|\bon\w+\s*=|@import|href\s*=\s*[\"'](?!#|data:)", re.I
)


def read_logo(path: Path, text: str) -> Logo:
    """Read the file; `text` replaces it for a screen reader.

    Raises
    ------
    ConfigError
        If it cannot be read, is too large, or is not a PNG or a passive SVG.
    """
    try:
        with path.open("rb") as file:
            data = file.read(BYTES_MAX + 1)
    except OSError as error:
        raise ConfigError(
            "file-unreadable",
            f"the logo {str(path)!r} cannot be read: {error.strerror}",
            "correct the name of the logo",
            path=str(path), key="report.logo",
        ) from None  # fmt: skip
    if len(data) > BYTES_MAX:
        raise _unusable(path, f"has more than {BYTES_MAX >> 20} MiB")
    if data.startswith(b"\x89PNG\r\n"):
        _check_png(path, data)
        return Logo(data, "png", text)
    if why := svg_fault(data):
        raise _unusable(path, why)
    return Logo(data, "svg", text)


def _check_png(path: Path, data: bytes) -> None:
    from io import BytesIO

    from PIL import Image

    try:
        with Image.open(BytesIO(data), formats=["PNG"]) as image:
            size = image.size
            if max(size) <= _PIXELS_MAX:
                image.load()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
        raise _unusable(path, "is damaged") from None
    if max(size) > _PIXELS_MAX:
        raise _unusable(path, f"has {size[0]} × {size[1]} pixels, more than {_PIXELS_MAX} on a side")


def svg_fault(data: bytes) -> str:
    """Why a file is not a passive SVG; empty if it is."""
    from xml.etree import ElementTree

    if match := _ACTIVE.search(data):
        content = match.group().decode("ascii", "replace")
        return f"contains {content!r}: a logo may not load or execute anything"
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError:
        return "is neither a PNG nor an SVG"
    return "" if root.tag == "{http://www.w3.org/2000/svg}svg" else "is neither a PNG nor an SVG"


def _unusable(path: Path, why: str) -> ConfigError:
    return ConfigError(
        "file-unusable",
        f"the logo {str(path)!r} {why}",
        "give a PNG or SVG file of at most 1 MiB",
        path=str(path), key="report.logo",
    )  # fmt: skip
