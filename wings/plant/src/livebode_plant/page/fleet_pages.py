"""The page of a fleet and its requests; a browser gets frames of the looks of all axes, or of those that changed.

| byte | type | content of a frame |
|---|---|---|
| 0 | 4 bytes | `LBFT` |
| 4 | u8 | version, 1 |
| 5 | u8 | kind: 0 all, 1 changes |
| 8 | u32 | layout: the numbers of the axes belong to it |
| 12 | u32 | number of axes, or of changes |
| 16 | | all: a byte for two axes, the first in its low 4 bits; changes: u32 each, axis in the low 28 bits, look above |

Numbers are little endian.
"""

from __future__ import annotations

import asyncio
import gzip
import struct
import time
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import field
from functools import partial
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from livebode.core import LivebodeError, ServerError
from livebode.dashboard import (
    Act,
    AlarmRequest,
    Board,
    BrowserSocket,
    Order,
    Pulse,
    Role,
    alarm_request,
    error_answer,
    json_object,
    serve_browser,
)
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.records import to_json
from livebode_plant.page.fleet_board import FleetBoard
from livebode_plant.page.fleet_feed import StatusFeed

TICK_S, IDLE_S = 0.25, 1.0
"""Between two updates of the board, with and without browsers."""
RETRY_S = 2.0
_WAITING_MAX = 1 << 14


@dataclass
class FleetView:
    """What `livebode fleet status --serve` shows: passes the messages of a feed to the board, and wakes the browsers.

    Attributes
    ----------
    feed
        Source of the messages.
    plan
        SVG of a floor plan; None without one.
    trends
        Address of a page of trends, to which "#axis=PATH" is appended; empty without one.
    lake
        Directory or URL of the lake with the results of the fleet; empty without one.
    """

    feed: StatusFeed
    plan: str | None = None
    trends: str = ""
    lake: str = ""
    board: FleetBoard = field(default_factory=FleetBoard)
    pulse: Pulse = field(default_factory=Pulse)
    browsers: int = 0
    _messages: deque[bytes] = field(default_factory=lambda: deque(maxlen=_WAITING_MAX))
    _acts: deque[bytes] = field(default_factory=deque)

    @property
    def static(self) -> Path:
        """Directory of the files of the page."""
        return Path(__file__).parent / "static"

    def routes(self, board: Board, file: Callable[[str], Response], order: Order) -> list[BaseRoute]:
        """Routes of the page."""
        return FleetPages(self, board, file, order).routes

    async def run(self) -> None:
        """Follow the feed until it is cancelled."""
        following = asyncio.create_task(self._follow())
        try:
            while not following.done():
                self._tick()
                await asyncio.wait([following], timeout=TICK_S if self.browsers else IDLE_S)
            following.result()
        finally:
            following.cancel()

    async def act(self, act: Act, asked: AlarmRequest) -> None:
        """Do what a person asks for; LivebodeError if it is impossible."""
        await self.feed.publish(self.board.act(act, asked, time.time()))

    async def _follow(self) -> None:
        while True:
            try:
                await self.feed.run(self._messages.append, self._acts.append)
            except LivebodeError as error:
                self.feed.trouble = str(error)
            await asyncio.sleep(RETRY_S)

    def _tick(self) -> None:
        now_s, board = time.time(), self.board
        messages = [self._messages.popleft() for _ in range(len(self._messages))]
        board.process(messages, now_s)
        while self._acts:
            board.process_act(self._acts.popleft())
        board.refresh(now_s)
        self.pulse.beat()


_HEADER = struct.Struct("<4sBBxxII")
_MAGIC, _VERSION, _ALL, _CHANGES = b"LBFT", 1, 0, 1
_AXIS_BITS = 28


def tiles_frame(layout: int, looks: np.ndarray[Any, Any], before: np.ndarray[Any, Any] | None) -> bytes:
    """What a page that shows `before` needs to show `looks`, in the shorter form; nothing if they are equal.

    >>> before = np.zeros(100_000, np.uint8)
    >>> after = before.copy()
    >>> after[70_000] = 3
    >>> len(tiles_frame(1, after, None)), len(tiles_frame(1, after, before)), len(tiles_frame(1, after, after))
    (50016, 20, 0)
    """
    if before is not None and len(before) == len(looks):
        changed = np.flatnonzero(looks != before)
        if not len(changed):
            return b""
        if 8 * len(changed) < len(looks):
            words = changed.astype("<u4") | (looks[changed].astype("<u4") << _AXIS_BITS)
            return _HEADER.pack(_MAGIC, _VERSION, _CHANGES, layout, len(changed)) + bytes(words.astype("<u4").tobytes())
    even = np.zeros(len(looks) + len(looks) % 2, np.uint8)
    even[: len(looks)] = looks
    pairs = even[::2] | (even[1::2] << 4)
    return _HEADER.pack(_MAGIC, _VERSION, _ALL, layout, len(looks)) + bytes(pairs.tobytes())


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
        rows: dict[ListName, Callable[[], Any]] = {
            "worst": board.worst,
            "alarms": lambda: board.open_alarms(now_s),
            "gaps": board.gaps,
            "workers": lambda: board.workers(now_s),
        }
        state: dict[str, Any] = {"trouble": self._view.feed.trouble, "layout": board.layout, "open": board.open_count}
        state[self._watched.list] = rows[self._watched.list]()
        if self._watched.axis is not None:
            state["axis"] = board.axis(self._watched.axis, now_s)
        news = {key: value for key, value in state.items() if self._sent.get(key) != value or key == "layout"}
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
        """Routes of the page."""
        answers = {"axes": self.axes, "plan": self.plan, "trend": self.trend}
        return [
            Route("/", self.page),
            *(Route(f"/api/{name}", partial(self._known, answer)) for name, answer in answers.items()),
            *(Route(f"/api/{act}", partial(self._act, act), methods=["POST"]) for act in get_args(Act)),
            WebSocketRoute("/live", self.live),
        ]

    async def _known(self, answer: Callable[[Request], Awaitable[Response]], request: Request) -> Response:
        """The answer to somebody who has logged in."""
        if self._board.access.role_of(request) is None:
            return JSONResponse(error_answer(Message("log in first")), 401)
        return await answer(request)

    async def page(self, request: Request) -> Response:
        return (
            RedirectResponse("/login", 303) if self._board.access.role_of(request) is None else self._file("fleet.html")
        )

    async def axes(self, _: Request) -> Response:
        """Path of each axis in a line, in order; the layout is in a header."""
        board = self._view.board
        if self._paths[0] != board.layout:
            self._paths = board.layout, gzip.compress("\n".join(board.paths).encode(), 1)
        headers = {"content-encoding": "gzip", "x-layout": str(board.layout)}
        return Response(self._paths[1], media_type="text/plain; charset=utf-8", headers=headers)

    async def plan(self, _: Request) -> Response:
        """The floor plan."""
        if self._view.plan is None:
            return JSONResponse({"error": "there is no floor plan"}, 404)
        return Response(self._view.plan, media_type="image/svg+xml")

    async def trend(self, request: Request) -> Response:
        """A quantity of an axis of this fleet over the last year."""
        path, axes = request.query_params.get("axis", ""), self._view.board.axes
        if (row := axes.row(path)) is None:
            raise ServerError("request-malformed", "the fleet has no such axis", Message("reload the page"))
        asked = path, request.query_params.get("quantity", ""), axes.names[row].parameter
        return Response(to_json(await self._board.elsewhere(self._trends.plain, *asked)), media_type="application/json")

    async def live(self, socket: WebSocket) -> None:
        await serve_browser(self._board, socket, lambda role: FleetClient(self._view, socket, role))

    async def _act(self, act: Act, request: Request) -> Response:
        data = await self._order(request)
        if isinstance(data, Response):
            return data
        axes = len(self._view.board.axes)
        if not axes:
            raise ServerError("not-begun", "no axis is known yet", "wait for the first status")
        await self._view.act(act, alarm_request(data, axes, act))
        return JSONResponse({}, 202)
