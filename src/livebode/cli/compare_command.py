"""`livebode compare`: differences between two runs of a machine."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.documents import write_documents
from livebode.cli.options import Json, Language
from livebode.core import UsageError
from livebode.language import in_language
from livebode.records import to_json


def compare_command(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Run directory.")],
    after: Annotated[Path, typer.Argument(metavar="AFTER", help="Directory of a later run with the same signals.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write FILE.html and FILE.pdf.")] = None,
    ignore_below: Annotated[
        str | None,
        typer.Option(metavar="SIZE", help="Smallest change of a line that matters, as 0.5dB or 5%. \\[default: any]"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    language: Language = "en",
    as_json: Json = False,
) -> None:
    """Find the lines, parameters and margins that differ between two runs, with amounts and bounds.

    A line differs if chance does not explain it; with --ignore-below only if |after/before − 1| is that large too.
    Runs with a schedule, such as a position, are compared by place and direction, and over all places.
    """
    from livebode.reporting.compare_report import Comparison

    found = Comparison.of(before, after, ignore_below=_share(ignore_below))
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
