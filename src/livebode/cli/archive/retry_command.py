"""`livebode archive retry`: track recordings in quarantine again."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from livebode.cli.archive.options import Archive
from livebode.cli.options import Json


def retry_command(
    archive: Archive,
    older: Annotated[
        bool, typer.Option("--older", help="Only those that an older version of livebode could not track.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Track recordings in quarantine again, each in a process of its own.

    One that is tracked leaves the quarantine.
    """
    from livebode.archive.coordinator import Coordinator
    from livebode.archive.settings import ArchiveSettings
    from livebode.cli.archive.showing import ArchiveProgress, show

    started, settings = time.monotonic(), ArchiveSettings.read(archive)
    with ArchiveProgress(quiet=as_json) as progress:
        outcome = Coordinator(settings, progress.report).retry(older)
    show(outcome, settings.lake, str(archive), time.monotonic() - started, as_json=as_json)
    if outcome.stopped:
        raise typer.Exit(130)
