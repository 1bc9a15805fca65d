"""`livebode compare`: differences between two runs of a machine."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.documents import write_documents
from livebode.cli.options import Json, Language
from livebode.language import in_language
from livebode.records import to_json


def compare_command(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Run directory.")],
    after: Annotated[Path, typer.Argument(metavar="AFTER", help="Directory of a later run with the same signals.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write FILE.html and FILE.pdf.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    language: Language = "en",
    as_json: Json = False,
) -> None:
    """Find the lines, parameters and margins that differ between two runs, with amounts and bounds.

    Runs with a schedule, such as a position, are compared by place and direction, and over all places.
    """
    from livebode.reporting.compare_report import Comparison

    found = Comparison.of(before, after)
    files: list[Path] = []
    remark = ""
    if out is not None:
        with in_language(language):
            files, remark = write_documents(found.document(datetime.now(UTC)), out, force=force)
    if as_json:
        print(to_json(found.plain()))
        return
    for finding in found.sentences:
        print(finding.text)
    for table in found.tables:
        print(f"\n{table}")
    for line in filter(None, (*files, remark)):
        print(line)
