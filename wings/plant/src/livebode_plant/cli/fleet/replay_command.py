"""`livebode fleet replay`: results computed again from the log, to compare the stored ones or to write one axis."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Json, NextCommand
from livebode_plant.cli.fleet.options import Fleet

if TYPE_CHECKING:
    from livebode_plant.fleet.fleet_settings import FleetSettings


def replay_command(
    fleet: Fleet,
    axis: Annotated[
        str | None, typer.Argument(metavar="AXIS", help="Path of one axis to write: site/line/machine/axis.")
    ] = None,
    from_: Annotated[
        datetime | None,
        typer.Option("--from", metavar="TIME", help="Beginning for AXIS, in local time. \\[default: of the log]"),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Parquet file to write for AXIS.")] = Path("replay.parquet"),
    as_json: Json = False,
) -> NextCommand:
    """Compute results again from the log: compare the stored ones bit for bit, or write those of an AXIS.

    The fleet may run meanwhile. Exit code 2 if a response, parameter or event is missing, doubled or different. Of an
    AXIS the responses are written as a table; with [fit] its parameters, derived quantities and margins are in a second
    one, FILE-parameters.parquet.
    """
    from livebode_plant.fleet.fleet_settings import FleetSettings

    settings = FleetSettings.read(fleet)
    if axis is None:
        _compare(settings, as_json=as_json)
    else:
        _write(settings, axis, 0.0 if from_ is None else from_.timestamp(), out, as_json=as_json)
    return NextCommand("fleet", "status", fleet)


def _compare(settings: FleetSettings, *, as_json: bool) -> None:
    from livebode.records import to_json
    from livebode_plant.fleet.log import with_log
    from livebode_plant.fleet.replay import check_results, require_exact, verdict

    axes = settings.read_axes()
    result = with_log(settings.log, "livebode replay", lambda log: check_results(log, axes))
    if as_json:
        print(to_json(result.as_dict()))
    require_exact(result)
    if not as_json:
        print(verdict(result))


def _write(settings: FleetSettings, axis: str, begin_s: float, out: Path, *, as_json: bool) -> None:
    from livebode.core import FleetError, nearest_name
    from livebode.records import to_json
    from livebode_plant.fleet.log import with_log
    from livebode_plant.fleet.replay import replayed, write_replayed
    from livebode_plant.fleet.subjects import axis_path

    axes = settings.read_axes()
    keys = {axis_path(key): key for key in axes}
    if axis not in keys:
        raise FleetError("axis-unknown", f"the fleet has no axis {axis!r}", nearest_name(axis, sorted(keys)), axis=axis)
    key = keys[axis]
    replay = with_log(settings.log, "livebode replay", lambda log: replayed(log, key, axes[key], begin_s))
    files = write_replayed(replay, out)
    if as_json:
        print(to_json({"files": {str(path): {"rows": rows} for path, rows in files.items()}}))
        return
    for path, rows in files.items():
        print(f"{path}: {rows:,} rows")
