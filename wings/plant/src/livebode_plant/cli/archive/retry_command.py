"""`livebode archive retry`: track recordings in quarantine again."""

from __future__ import annotations

from typing import Annotated

import typer

from livebode.cli import Json
from livebode_plant.cli.archive.options import Archive


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
    from livebode_plant.cli.archive.showing import track

    track(archive, lambda coordinator: coordinator.retry(older), as_json=as_json)
