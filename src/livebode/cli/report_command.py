"""`livebode report`: write a report of a run as one HTML file and a PDF."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.documents import write_documents
from livebode.cli.options import Json, Language


def report_command(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory; the run need not be finished.")],
    on: Annotated[
        Path | None,
        typer.Option(
            "--on", metavar="LOG", help="Validate the model on this recording, which the run does not contain."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File name without suffix. \\[default: RUN/report]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing report at --out.")] = False,
    language: Language = "en",
    as_json: Json = False,
) -> None:
    """Write the measurement, its settings and its results as report.html and report.pdf.

    An existing report in the run directory is replaced. The PDF needs the extra `pdf`.
    """
    from livebode.core.clock import moments_by
    from livebode.language import in_language
    from livebode.records import RunRecord, to_json
    from livebode.reporting.report_data import Judged
    from livebode.reporting.run_report import run_report

    judged = None
    if on is not None:
        from livebode.analysis.validation import validate_run
        from livebode.configuration.axis import FitSection
        from livebode.configuration.recorded import recorded_configuration

        section = FitSection.model_validate(recorded_configuration(RunRecord.open(directory).summary).get("fit", {}))
        found, notes = validate_run(directory, on, [section])
        judged = Judged(on.name, tuple(found), tuple(notes))
    with moments_by(RunRecord.open(directory, on_damage=lambda _: None).clock), in_language(language):
        document = run_report(directory, judged, made=datetime.now(UTC))
        files, remark = write_documents(document, out or directory / "report", force=force or out is None)
    if as_json:
        print(to_json({"files": list(map(str, files))}))
        return
    for line in filter(None, (*files, remark)):
        print(line)
