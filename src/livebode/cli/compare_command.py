"""`livebode compare`: a machine before and after."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.documents import write_documents
from livebode.cli.options import Json
from livebode.records import to_json


def compare_command(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Directory that a run left.")],
    after: Annotated[Path, typer.Argument(metavar="AFTER", help="Directory of a later run of the same signals.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write FILE.html and FILE.pdf.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    as_json: Json = False,
) -> None:
    """Say which lines, parameters and margins differ between two runs, by how much, with bounds.

    Runs that moved along a schedule are compared place by place and way by way, and over the places together.
    """
    from livebode.session.reporting.compare_report import Comparison

    found = Comparison.of(before, after)
    files: list[Path] = []
    remark = ""
    if out is not None:
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
