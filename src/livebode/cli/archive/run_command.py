"""`livebode archive run`: track the recordings of an archive that its lake does not have yet."""

from __future__ import annotations

import time

import typer

from livebode.cli.archive.options import Archive
from livebode.cli.options import Json


def run_command(archive: Archive, as_json: Json = False) -> None:
    """Track the recordings of an archive that its lake does not have yet.

    A recording that cannot be tracked goes to quarantine with the reason. Ctrl-C ends with whole results; the same
    command continues.
    """
    from livebode.archive.coordinator import Coordinator
    from livebode.archive.settings import ArchiveSettings
    from livebode.cli.archive.showing import ArchiveProgress, show

    started, settings = time.monotonic(), ArchiveSettings.read(archive)
    with ArchiveProgress(quiet=as_json) as progress:
        outcome = Coordinator(settings, progress.report).run()
    show(outcome, settings.lake, str(archive), time.monotonic() - started, as_json=as_json)
    if outcome.stopped:
        raise typer.Exit(130)
