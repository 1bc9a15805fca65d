"""`livebode report`: a run as one HTML file and a PDF."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.documents import write_documents
from livebode.cli.options import Json


def report_command(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Directory that a run left, finished or not.")],
    on: Annotated[
        Path | None,
        typer.Option("--on", metavar="LOG", help="A recording that the run was not made of, to judge its model by."),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Without an ending; RUN/report unless said.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing report elsewhere than in RUN.")] = False,
    as_json: Json = False,
) -> None:
    """Write what a run measured, how, and what it comes to: report.html and report.pdf.

    A report in the run's own directory is replaced. The PDF needs the extra `pdf`.
    """
    from livebode.core.clock import RunClock, moments_by
    from livebode.records import Run, to_json
    from livebode.session.reporting.material import Judged
    from livebode.session.reporting.run_report import run_report

    judged = None
    if on is not None:
        from livebode.session.axis import FitSection
        from livebode.session.said import said
        from livebode.session.validation import validate_run

        section = FitSection.model_validate(said(Run.open(directory).summary).get("fit", {}))
        found, notes = validate_run(directory, on, [section])
        judged = Judged(on.name, tuple(found), tuple(notes))
    with moments_by(RunClock.of(Run.open(directory, told=lambda _: None).summary)):
        document = run_report(directory, judged, made=datetime.now(UTC))
        files, remark = write_documents(document, out or directory / "report", force=force or out is None)
    if as_json:
        print(to_json({"files": list(map(str, files))}))
        return
    for line in filter(None, (*files, remark)):
        print(line)
