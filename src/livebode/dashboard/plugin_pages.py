"""PluginPages: what a dashboard shows instead of axes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import BaseRoute

    from livebode.dashboard.board import Board

Order = Callable[["Request"], Awaitable["bytes | Response"]]


class PluginPages(Protocol):
    """Pages of a plug-in, with the login, the access control and the limits of the dashboard."""

    @property
    def static(self) -> Path:
        """Directory of their scripts, styles and HTML, which are served beside those of the dashboard."""

    def routes(self, board: Board, file: Callable[[str], Response], order: Order) -> list[BaseRoute]:
        """The routes.

        Parameters
        ----------
        board
            Without axes: access control and places.
        file
            Answers with a static file.
        order
            The JSON of an operator, or the answer to somebody else.
        """

    async def run(self) -> None:
        """Update what the pages show until it is cancelled, in the thread of the server."""
