"""`livebode compare`: differences between two runs of a machine."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli.options import Entry, Json
from livebode.cli.report_options import (
    Appendix,
    Ask,
    Company,
    Conditions,
    Customer,
    LogoFile,
    Machine,
    Operator,
    PaperSize,
    ReportLanguage,
    SerialNumber,
    Template,
    header,
)
from livebode.core import UsageError
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.reporting.matrix_comparison import MatrixComparison


def compare_command(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Run directory.", parser=location)],
    after: Annotated[
        Path, typer.Argument(metavar="AFTER", help="Directory of a later run with the same signals.", parser=location)
    ],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write FILE.html and FILE.pdf.")] = None,
    ignore_below: Annotated[
        str | None,
        typer.Option(metavar="SIZE", help="Smallest change of a line that matters, as 0.5dB or 5%. \\[default: any]"),
    ] = None,
    entry: Entry = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    template: Template = None,
    machine: Machine = None,
    serial_number: SerialNumber = None,
    operator: Operator = None,
    company: Company = None,
    customer: Customer = None,
    conditions: Conditions = None,
    logo: LogoFile = None,
    paper: PaperSize = None,
    language: ReportLanguage = None,
    ask: Ask = False,
    appendix: Appendix = False,
    as_json: Json = False,
) -> None:
    """Find the lines, parameters and margins that differ between two runs, with amounts and bounds.

    A line differs if chance does not explain it; with --ignore-below only if |after/before − 1| is that large too.
    Runs with a schedule, such as a position, are compared by place and direction, and over all places. Of two matrix
    runs all entries are compared; files show one of them (--entry). The first page of the files is as in `livebode
    report`; limits apply to AFTER.
    """
    from livebode.cli.documents import write_documents
    from livebode.configuration.recorded import recorded_report
    from livebode.language import in_language
    from livebode.records import to_json
    from livebode.reporting.compare_report import Comparison
    from livebode.reporting.matrix_comparison import MatrixComparison, both_matrices

    if entry is None and out is None and (pair := both_matrices(before, after)) is not None:
        _show_matrices(MatrixComparison.of(*pair, ignore_below=_share(ignore_below)), as_json)
        return
    found = Comparison.of(before, after, ignore_below=_share(ignore_below), entry=entry)
    files: list[Path] = []
    remark = ""
    options = {
        "machine": machine, "serial_number": serial_number, "operator": operator, "company": company,
        "customer": customer, "conditions": conditions, "logo": logo, "paper": paper,
    }  # fmt: skip
    if out is None and (template is not None or ask or appendix or language or any(options.values())):
        raise _needs_out()
    if out is not None:
        first = header(recorded_report(found.found.runs[1].summary), template, ask, options)
        with in_language(language or first.language or "en"):
            document = found.document(datetime.now(UTC), header=first, appendix=appendix)
            files, remark = write_documents(document, out, force=force)
    if as_json:
        print(to_json(found.plain()))
        return
    for finding in found.sentences:
        print(finding.text)
    for table in found.tables:
        print(f"\n{table}")
    if not found.changes.parameters:
        print(found.changes.parameter_words)
    for line in filter(None, (*files, remark)):
        print(line)


def _show_matrices(found: MatrixComparison, as_json: bool) -> None:
    from livebode.records import to_json

    if as_json:
        print(to_json(found.plain()))
        return
    for sentence in found.sentences:
        print(sentence)
    for table in found.tables:
        print(f"\n{table}")


def _needs_out() -> UsageError:
    return UsageError(
        "missing",
        "the options of the first page belong to the files of --out, which is missing",
        "add --out FILE",
        argument="out",
    )


def _share(text: str | None) -> float:
    """|ratio − 1| of a size in dB or %."""
    if text is None:
        return 0.0
    number, unit = re.fullmatch(r"\s*([0-9.eE+-]*)\s*(.*?)\s*", text).groups()  # type: ignore[union-attr]
    try:
        size = float(number)
    except ValueError:
        size = -1.0
    if unit not in ("dB", "%") or not 0 <= size < inf:
        raise UsageError(
            "unreadable",
            f"the size {text!r} is not a number of dB or %",
            "write for example 0.5dB or 5%",
            argument="ignore_below",
            value=text,
        )
    return float(10 ** (size / 20) - 1) if unit == "dB" else size / 100
