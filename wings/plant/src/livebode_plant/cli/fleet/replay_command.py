"""`livebode fleet replay`: an axis computed again from the log."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Json
from livebode_plant.cli.fleet.options import Fleet

if TYPE_CHECKING:
    from livebode_plant.fleet.replay import ReplayedAxis


def replay_command(
    fleet: Fleet,
    axis: Annotated[str, typer.Argument(metavar="AXIS", help="Path of the axis: site/line/machine/axis.")],
    from_: Annotated[
        datetime | None, typer.Option("--from", metavar="TIME", help="Beginning, in local time. Default: of the log.")
    ] = None,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Parquet file to write.")] = Path("replay.parquet"),
    as_json: Json = False,
) -> None:
    """Compute the responses and fits of an axis again from the log, and write them as tables.

    With [fit] its parameters, derived quantities and margins are in a second one, FILE-parameters.parquet.
    """
    import asyncio

    from livebode.core import FleetError, nearest_name
    from livebode.records import to_json
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import FleetLog
    from livebode_plant.fleet.replay import replayed, write_replayed
    from livebode_plant.fleet.subjects import axis_path

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()
    keys = {axis_path(key): key for key in axes}
    if axis not in keys:
        raise FleetError("axis-unknown", f"the fleet has no axis {axis!r}", nearest_name(axis, sorted(keys)), axis=axis)

    async def replay() -> ReplayedAxis:
        async with FleetLog(settings.log, "livebode replay") as log:
            return await replayed(log, keys[axis], axes[keys[axis]], 0.0 if from_ is None else from_.timestamp())

    files = write_replayed(asyncio.run(replay()), out)
    if as_json:
        print(to_json({"files": {str(path): {"rows": rows} for path, rows in files.items()}}))
        return
    for path, rows in files.items():
        print(f"{path}: {rows:,} rows")
