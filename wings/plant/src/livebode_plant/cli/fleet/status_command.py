"""`livebode fleet status`: the state of a fleet, in the terminal or as a page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import Json, NextCommand, Port, ServeFile, console
from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode_plant.page.fleet_feed import StatusFeed

_SHOWN = 20


def status_command(
    fleet: Annotated[
        Path | None, typer.Argument(metavar="FLEET.TOML", help="Configuration of the fleet; not for --demo.")
    ] = None,
    serve: Annotated[
        bool, typer.Option("--serve", help="Show a tile for each axis in a browser instead, until Ctrl-C.")
    ] = False,
    demo: Annotated[
        int | None, typer.Option(metavar="AXES", min=1, max=200_000, help="Show a simulated fleet of so many axes.")
    ] = None,
    plan: Annotated[
        Path | None,
        typer.Option(
            metavar="PLAN.svg",
            help="Floor plan of the page: elements whose id or data-axis is the path of an axis or a machine show its "
            "state.",
        ),
    ] = None,
    trends: Annotated[
        str, typer.Option(metavar="URL", help="Page of trends, such as that of `livebode view`; each axis links to it.")
    ] = "",
    port: Port = None,
    axis: ServeFile = None,
    as_json: Json = False,
) -> NextCommand | None:
    """Show partitions, axes, alarms, backlog and losses of a fleet; with --serve a page with a tile for each axis.

    Acknowledgements and shelves on the page are stored in the log of the fleet, so that all pages of it show the same.
    """
    if (fleet is None) == (demo is None):
        raise UsageError(
            "options",
            "give either FLEET.toml or --demo AXES",
            "`livebode fleet status --demo 10000` shows a simulated fleet in a browser",
            options=["--demo"],
        )
    if serve or fleet is None:
        serve_page(fleet, demo, plan, trends, port, axis)
        return None
    _print_status(fleet, as_json=as_json)
    return NextCommand("fleet", "status", fleet, "--serve")


def _print_status(fleet: Path, *, as_json: bool) -> None:
    from livebode.records import to_json
    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.fleet.log import with_log
    from livebode_plant.fleet.status import fleet_status

    settings = FleetSettings.read(fleet)
    axes = settings.read_axes()
    status = with_log(settings.log, "livebode status", lambda log: fleet_status(log, axes))
    if as_json:
        print(to_json(status))
    else:
        _show(status)


def _show(status: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table("partition", "owner", "behind", "axes", box=None, pad_edge=False)
    for one in status["partitions"]:
        held = sum(axis["partition"] == one["partition"] for axis in status["axes"])
        table.add_row(str(one["partition"]), one["owner"], f"{one['lag_s']:.1f} s", str(held))
    console(markup=False).print(table)
    log = status["log"]
    print(
        f"\nlog: {log['messages']:,} messages, {log['bytes'] / 1e6:,.0f} MB, {log['full_share']:.1%} of its limit; "
        f"{log['waiting']:,} not processed yet"
    )
    print(f"axes: {len(status['axes'])} with data, {len(status['without_data'])} without")
    for one in status["sinks"]:
        print(f"sink of {one['lake']}: {one['behind']:,} messages of results behind, {one['behind_s']:,.0f} s")
    for alarm in status["alarms"][:_SHOWN]:
        print(f"alarm: {alarm}")
    if len(status["alarms"]) > _SHOWN:
        print(f"and {len(status['alarms']) - _SHOWN} more alarms")


def serve_page(
    fleet: Path | None, demo: int | None, plan: Path | None, trends: str, port: int | None, axis: Path | None
) -> None:
    """Serve the page of a fleet, or of a simulated one with so many axes, until Ctrl-C."""
    from livebode.cli import dashboard_of, print_line, wait_for_the_end
    from livebode.configuration import ServeSection, read_serve_section

    if trends and not trends.startswith(("https://", "http://", "/")):
        raise UsageError("unreadable", f"{trends!r} is not an address", "begin it with https://", argument="trends")
    dashboard = dashboard_of(ServeSection() if axis is None else read_serve_section(axis), port)
    from livebode_plant.page.fleet_pages import FleetView
    from livebode_plant.page.floor_plan import floor_plan

    drawing = None if plan is None else floor_plan(plan)
    feed, lake = _demo(demo or 1) if fleet is None else _log(fleet)
    dashboard.show(FleetView(feed, drawing, trends, lake))
    with dashboard:
        print_line(f"the fleet is at {dashboard.url}")
        wait_for_the_end()


def _demo(axes: int) -> tuple[StatusFeed, str]:
    from livebode_plant.page.fleet_feed import DemoFeed, DemoFleet

    return DemoFeed(DemoFleet(axes)), ""


def _log(fleet: Path) -> tuple[StatusFeed, str]:
    """The feed of a log, and its lake."""
    import asyncio

    from livebode_plant.fleet.fleet_settings import FleetSettings
    from livebode_plant.page.fleet_feed import NatsFeed

    settings = FleetSettings.read(fleet)
    feed = NatsFeed(settings.log, fleet.stem)
    asyncio.run(_tried(feed))
    return feed, settings.sink.lake or ""


async def _tried(feed: StatusFeed) -> None:
    """Connect once, so that a wrong address is reported before the page opens."""
    from livebode_plant.page.fleet_feed import NatsFeed

    assert isinstance(feed, NatsFeed)
    await feed.connect()
    await feed.close()
