"""The web socket of a browser that shows a fleet."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Literal, cast, get_args

import numpy as np
from starlette.websockets import WebSocket

from livebode.core import ServerError
from livebode.dashboard import BrowserSocket, Role, json_object
from livebode.language import Message
from livebode_plant.page.fleet_frames import tiles_frame
from livebode_plant.page.fleet_view import FleetView

ListName = Literal["worst", "alarms", "workers", "gaps"]
LISTS_EVERY_S = 0.5


@dataclass(frozen=True)
class Watched:
    """Which list a page shows, and the number of its chosen axis; None without one."""

    list: ListName = "worst"
    axis: int | None = None


def watched(text: str) -> Watched:
    """Parse a message of the page; ServerError if it is invalid.

    >>> watched('{"list": "alarms", "axis": 7}')
    Watched(list='alarms', axis=7)
    """
    message = json_object(text, "message")
    name, axis = message.get("list"), message.get("axis")
    if name not in get_args(ListName) or not (axis is None or (type(axis) is int and 0 <= axis < 1 << 28)):
        raise ServerError(
            "request-malformed", "the message does not name a list and an axis", Message("reload the page")
        )
    return Watched(cast(ListName, name), axis)


class FleetClient(BrowserSocket):
    """Sends changes of the tiles some times a second, and lists twice a second."""

    def __init__(self, view: FleetView, socket: WebSocket, role: Role) -> None:
        super().__init__(socket)
        self._view, self._role = view, role
        self._watched = Watched()
        self._layout: int | None = None
        self._looks: np.ndarray[Any, Any] | None = None
        self._sent: dict[str, Any] = {}
        self._due_s = 0.0

    async def run(self) -> None:
        """Serve until the browser disconnects or exceeds a limit."""
        self._view.browsers += 1
        try:
            await super().run()
        finally:
            self._view.browsers -= 1

    async def heed(self, text: str) -> None:
        """Show another list or axis."""
        self._watched, self._due_s = watched(text), 0.0

    async def send_news(self) -> None:
        """Send changes until it is cancelled."""
        while True:
            await self._send_tiles()
            if time.monotonic() >= self._due_s:
                self._due_s = time.monotonic() + LISTS_EVERY_S
                await self._send_lists()
            await self._view.pulse.wait_next()

    async def _send_tiles(self) -> None:
        board = self._view.board
        if board.layout != self._layout:
            self._layout, self._looks = board.layout, None
            await self.send({"fleet": self._facts()})
        looks = board.looks
        if data := tiles_frame(board.layout, looks, self._looks):
            await self.send_bytes(data)
        self._looks = looks

    async def _send_lists(self) -> None:
        board, now_s = self._view.board, time.time()
        name = self._watched.list
        found: dict[str, Any] = {"trouble": self._view.feed.trouble, "layout": board.layout}
        found["open"] = board.open_count
        if name == "worst":
            found["worst"] = board.worst()
        elif name == "alarms":
            found["alarms"] = board.open_alarms(now_s)
        elif name == "gaps":
            found["gaps"] = board.gaps()
        else:
            found["workers"] = board.workers(now_s)
        if self._watched.axis is not None:
            found["axis"] = board.axis(self._watched.axis, now_s)
        news = {key: value for key, value in found.items() if self._sent.get(key) != value or key == "layout"}
        self._sent |= news
        if len(news) > 1:
            await self.send(news)

    def _facts(self) -> dict[str, Any]:
        view = self._view
        return {
            "name": view.feed.name,
            "role": self._role if view.feed.may_act else "viewer",
            "layout": view.board.layout,
            "axes": len(view.board.axes),
            "plan": view.plan is not None,
            "trends": view.trends,
        }
