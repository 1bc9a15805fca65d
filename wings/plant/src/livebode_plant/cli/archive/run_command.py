"""`livebode archive run`: track the recordings of an archive that its lake does not have yet."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from livebode.cli import Json, check_use
from livebode_plant.cli.archive.options import LakeOf


def run_command(
    context: typer.Context,
    archive: LakeOf,
    retry: Annotated[
        Literal["all", "older"] | None,
        typer.Option(
            help="Track recordings in quarantine again instead, each in a process of its own: all, or those that an "
            "older version of livebode could not track."
        ),
    ] = None,
    compact: Annotated[
        bool,
        typer.Option(
            "--compact", help="Join the small files of the lake instead, and remove files that belong to no result."
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Track the recordings of an archive that its lake does not have yet.

    A recording that cannot be tracked goes to quarantine with the reason. Ctrl-C ends with whole results; the same
    command continues. Files that no table has are removed by --compact when they are older than a week: an archive that
    runs now loses none. A table with results that are not complete is left as it is.
    """
    from livebode_plant.cli.archive.showing import track

    check_use(context, "--compact", ())
    if compact:
        _compact(archive, as_json=as_json)
    elif retry is not None:
        track(Path(archive), lambda coordinator: coordinator.retry(retry == "older"), as_json=as_json)
    else:
        track(Path(archive), lambda coordinator: coordinator.run(), as_json=as_json)


def _compact(archive: str, *, as_json: bool) -> None:
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.lake import Lake, compact

    found = compact(Lake(lake_url(archive)))
    if as_json:
        print(to_json({"tables": [vars(one) for one in found]}))
        return
    for one in found:
        print(f"{one.table}: {one.before:,} files, now {one.after:,}; {one.removed:,} old ones removed")
        if one.open_results:
            remark = f"{one.open_results:,} results are not complete: let the archive run to its end first"
            print(f"livebode: {one.table}: files not joined; {remark}", file=sys.stderr)
