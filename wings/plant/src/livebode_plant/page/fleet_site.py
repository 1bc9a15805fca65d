"""FleetSite: the page of a fleet, as the dashboard serves pages of plug-ins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from livebode.dashboard import Order
from livebode_plant.page.fleet_view import FleetView

if TYPE_CHECKING:
    from starlette.responses import Response
    from starlette.routing import BaseRoute

    from livebode.dashboard import Board


@dataclass(frozen=True)
class FleetSite:
    """A fleet for `Dashboard.show`; it can be made without the packages of the dashboard."""

    view: FleetView

    @property
    def static(self) -> Path:
        """Directory of the files of the page."""
        return Path(__file__).parent / "static"

    def routes(self, board: Board, file: Callable[[str], Response], order: Order) -> list[BaseRoute]:
        """The routes of the page."""
        from livebode_plant.page.fleet_pages import FleetPages

        return FleetPages(self.view, board, file, order).routes

    async def run(self) -> None:
        """Follow the fleet until it is cancelled."""
        await self.view.run()
