"""`livebode fleet status --serve`: the page of a fleet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from livebode.core import UsageError

if TYPE_CHECKING:
    from livebode_plant.page.fleet_feed import StatusFeed


def serve_page(
    fleet: Path | None, demo: int | None, plan: Path | None, trends: str, port: int | None, axis: Path | None
) -> None:
    """Serve the page of a fleet, or of a simulated one with so many axes, until Ctrl-C."""
    from livebode.cli import dashboard_of, print_line, wait_for_the_end
    from livebode.configuration import ServeSection, read_serve_section

    if trends and not trends.startswith(("https://", "http://", "/")):
        raise UsageError("unreadable", f"{trends!r} is not an address", "begin it with https://", argument="trends")
    dashboard = dashboard_of(ServeSection() if axis is None else read_serve_section(axis), port)
    from livebode_plant.page.fleet_pages import FleetSite
    from livebode_plant.page.fleet_view import FleetView
    from livebode_plant.page.floor_plan import floor_plan

    drawing = None if plan is None else floor_plan(plan)
    feed, lake = _demo(demo or 1) if fleet is None else _log(fleet)
    dashboard.show(FleetSite(FleetView(feed, drawing, trends, lake)))
    with dashboard:
        print_line(f"the fleet is at {dashboard.url}")
        wait_for_the_end()


def _demo(axes: int) -> tuple[StatusFeed, str]:
    from livebode_plant.page.fleet_demo import DemoFeed, DemoFleet

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
