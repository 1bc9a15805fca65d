"""`livebode archive run`: track the recordings of an archive that its lake does not have yet."""

from __future__ import annotations

from livebode.cli import Json
from livebode_plant.cli.archive.options import Archive


def run_command(archive: Archive, as_json: Json = False) -> None:
    """Track the recordings of an archive that its lake does not have yet.

    A recording that cannot be tracked goes to quarantine with the reason. Ctrl-C ends with whole results; the same
    command continues.
    """
    from livebode_plant.cli.archive.showing import track

    track(archive, lambda coordinator: coordinator.run(), as_json=as_json)
