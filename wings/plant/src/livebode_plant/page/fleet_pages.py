"""The page of a fleet and its requests."""

from __future__ import annotations

import gzip
from collections.abc import Callable

from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from livebode.core import ServerError
from livebode.dashboard import Act, Board, Order, Role, alarm_request, error_answer, serve_browser
from livebode.language import Message
from livebode.records import to_json
from livebode_plant.page.fleet_client import FleetClient
from livebode_plant.page.fleet_view import FleetView


class FleetPages:
    """The handlers of the routes.

    Parameters
    ----------
    view
        The fleet.
    board
        Without axes: access control and places.
    file
        Answers with a static file.
    order
        The JSON of an operator, or the answer to somebody else.
    """

    def __init__(self, view: FleetView, board: Board, file: Callable[[str], Response], order: Order) -> None:
        self._view, self._board, self._file, self._order = view, board, file, order
        self._paths: tuple[int, bytes] = -1, b""
        from livebode_plant.page.fleet_trend import AxisTrends  # with PyArrow, which a fleet needs

        self._trends = AxisTrends(view.lake)

    @property
    def routes(self) -> list[BaseRoute]:
        """All of them."""
        return [
            Route("/", self.page),
            Route("/api/axes", self.axes),
            Route("/api/plan", self.plan),
            Route("/api/trend", self.trend),
            Route("/api/acknowledge", self.acknowledge, methods=["POST"]),
            Route("/api/shelve", self.shelve, methods=["POST"]),
            Route("/api/unshelve", self.unshelve, methods=["POST"]),
            WebSocketRoute("/live", self.live),
        ]

    async def page(self, request: Request) -> Response:
        return RedirectResponse("/login", 303) if self._role(request) is None else self._file("fleet.html")

    async def axes(self, request: Request) -> Response:
        """Path of each axis in a line, in order; the layout is in a header."""
        if self._role(request) is None:
            return _unknown()
        board = self._view.board
        if self._paths[0] != board.layout:
            self._paths = board.layout, gzip.compress("\n".join(board.paths).encode(), 1)
        headers = {"content-encoding": "gzip", "x-layout": str(board.layout)}
        return Response(self._paths[1], media_type="text/plain; charset=utf-8", headers=headers)

    async def plan(self, request: Request) -> Response:
        """The floor plan."""
        if self._role(request) is None:
            return _unknown()
        if self._view.plan is None:
            return JSONResponse({"error": "there is no floor plan"}, 404)
        return Response(self._view.plan, media_type="image/svg+xml")

    async def trend(self, request: Request) -> Response:
        """A quantity of an axis of this fleet over the last year."""
        if self._role(request) is None:
            return _unknown()
        path, axes = request.query_params.get("axis", ""), self._view.board.axes
        if (row := axes.row(path)) is None:
            raise ServerError("request-malformed", "the fleet has no such axis", Message("reload the page"))
        asked = path, request.query_params.get("quantity", ""), axes.names[row].parameter
        return Response(to_json(await self._board.elsewhere(self._trends.plain, *asked)), media_type="application/json")

    async def acknowledge(self, request: Request) -> Response:
        return await self._act(request, "acknowledge")

    async def shelve(self, request: Request) -> Response:
        return await self._act(request, "shelve")

    async def unshelve(self, request: Request) -> Response:
        return await self._act(request, "unshelve")

    async def live(self, socket: WebSocket) -> None:
        await serve_browser(self._board, socket, lambda role: FleetClient(self._view, socket, role))

    async def _act(self, request: Request, act: Act) -> Response:
        data = await self._order(request)
        if isinstance(data, Response):
            return data
        axes = len(self._view.board.axes)
        if not axes:
            raise ServerError("not-begun", "no axis is known yet", "wait for the first status")
        await self._view.act(act, alarm_request(data, axes, act))
        return JSONResponse({}, 202)

    def _role(self, request: Request) -> Role | None:
        headers, address = request.headers, request.client.host if request.client else ""
        return self._board.access.role(headers.get("cookie", ""), headers.get("authorization", ""), address)


def _unknown() -> Response:
    return JSONResponse(error_answer(Message("log in first")), 401)
