"""`livebode report`: write a report of a run as one HTML file and a PDF."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli import Entry, Json, NextCommand, ReportLanguage, results_directory, with_keys
from livebode.estimates import kind_of
from livebode.locations import location
from livebode_reports.cli.report_options import FIRST_PAGE, Appendix, Ask, Template, header

_NOT_ALL_MET = 4


@with_keys(report=FIRST_PAGE)
def report_command(
    directory: Annotated[
        Path, typer.Argument(metavar="RUN", help="Run directory; the run need not be finished.", parser=location)
    ],
    on: Annotated[
        Path | None,
        typer.Option(
            "--on",
            metavar="LOG",
            help="Validate the model on this recording, which the run does not contain.",
            parser=location,
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File name without suffix. \\[default: RUN/report]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing report at --out.")] = False,
    template: Template = None,
    *,
    sections: dict[str, dict[str, Any]],
    language: ReportLanguage = None,
    entry: Entry = None,
    ask: Ask = False,
    appendix: Appendix = False,
    check: Annotated[
        bool, typer.Option("--check", help="Exit code 4 unless all limits are met; without limits, a usage error.")
    ] = False,
    as_json: Json = False,
) -> NextCommand:
    """Write the measurement and its results as report.html and report.pdf, with the verdict on page 1.

    The first page and the limits are from the [report] of the axis.toml with which the run was recorded, from
    --template, and from the options. An existing report in the run directory is replaced. The PDF needs the extra
    `pdf`. Without --check the exit code does not depend on the limits. The report of a matrix run shows all entries;
    with --entry it is that of one response, with its limits.
    """
    from livebode.analysis import model_test
    from livebode.configuration import recorded_report
    from livebode.core import moments_by
    from livebode.language import in_language
    from livebode.records import RunRecord, entry_missing, to_json
    from livebode_reports.files import write_documents
    from livebode_reports.kinds import rule_of

    run = RunRecord.open(directory, on_damage=lambda _: None, matrix=True, entry=entry)
    first = header(recorded_report(run.summary), template, ask, sections.get("report", {}))
    if check and not first.limits:
        raise _no_limits()
    if on is not None and (run.is_matrix or entry is not None):
        raise _not_on_an_entry()
    if check and run.is_matrix:
        raise entry_missing(str(directory), run.summary)
    judged = None if on is None else model_test(directory, on)
    with moments_by(run.clock), in_language(language or first.language or "en"):
        document, accepted = rule_of(kind_of(run.summary), "report")(
            directory, judged, made=datetime.now(UTC), header=first, appendix=appendix, entry=entry
        )
        files, remark = write_documents(
            document, out or results_directory(directory) / "report", force=force or out is None
        )
    results = [a.result for a in accepted]
    if as_json:
        result = {"files": list(map(str, files)), "verdict": document.result[0].tone}
        print(to_json(result | ({"limits": [a.plain() for a in accepted]} if accepted else {})))
    else:
        for line in filter(None, (*files, remark, _counted(results))):
            print(line)
    if check and set(results) != {"pass"}:
        raise typer.Exit(_NOT_ALL_MET)
    return NextCommand("view", directory)


def _counted(results: Sequence[str]) -> str:
    words = {"pass": "met", "fail": "failed", "undecided": "not decided"}
    counts = [f"{results.count(result)} {word}" for result, word in words.items() if result in results]
    return f"limits: {', '.join(counts)}" if counts else ""


def _no_limits() -> Exception:
    from livebode.core import UsageError

    return UsageError(
        "missing",
        "--check needs limits, and neither the run nor a template has any",
        "add [[report.limits]] to the axis.toml, or use --template",
        argument="--check",
    )


def _not_on_an_entry() -> Exception:
    from livebode.core import UsageError

    return UsageError(
        "conflict",
        "a report of a matrix run, or of its --entry, has no --on: the other inputs move in the recording, too",
        "compare the entry with another run by `livebode validate RUN --entry OUTPUT/INPUT --on RUN`",
        options=["--on", "--entry"],
    )
