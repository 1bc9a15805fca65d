"""`livebode fleet status`: the state of a fleet."""

from __future__ import annotations

from typing import Any

from livebode.cli import Json, console
from livebode_plant.cli.fleet.options import Fleet

_SHOWN = 20


def status_command(fleet: Fleet, as_json: Json = False) -> None:
    """Show partitions, axes, backlog and losses of a fleet."""
    import asyncio

    from livebode.records import to_json
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import FleetLog
    from livebode_plant.fleet.status import fleet_status

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()

    async def status() -> dict[str, Any]:
        async with FleetLog(settings.log, "livebode status") as log:
            return await fleet_status(log, axes)

    found = asyncio.run(status())
    if as_json:
        print(to_json(found))
        return
    _show(found)


def _show(found: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table("partition", "owner", "behind", "axes", box=None, pad_edge=False)
    for one in found["partitions"]:
        held = sum(axis["partition"] == one["partition"] for axis in found["axes"])
        table.add_row(str(one["partition"]), one["owner"], f"{one['lag_s']:.1f} s", str(held))
    console(markup=False).print(table)
    log = found["log"]
    print(
        f"\nlog: {log['messages']:,} messages, {log['bytes'] / 1e6:,.0f} MB, {log['full_share']:.1%} of its limit; "
        f"{log['waiting']:,} not processed yet"
    )
    print(f"axes: {len(found['axes'])} with data, {len(found['without_data'])} without")
    for one in found["sinks"]:
        print(f"sink of {one['lake']}: {one['behind']:,} messages of results behind, {one['behind_s']:,.0f} s")
    for alarm in found["alarms"][:_SHOWN]:
        print(f"alarm: {alarm}")
    if len(found["alarms"]) > _SHOWN:
        print(f"and {len(found['alarms']) - _SHOWN} more alarms")
