"""The web socket of a browser: admission, limits, the end of one that is slow or displaced, and updates of an axis."""

from __future__ import annotations

import asyncio
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from livebode.core import LivebodeError, Responses, ServerError
from livebode.dashboard.access import Role, error_answer
from livebode.dashboard.board import Board
from livebode.dashboard.frames import frame, reference_kind
from livebode.dashboard.past import Past
from livebode.dashboard.places import ClientPlace
from livebode.dashboard.queries import ClientMessage, client_message
from livebode.language import Message
from livebode.records import read_saved, to_json

if TYPE_CHECKING:
    from livebode.dashboard.state import State

SLOW_S = 20.0
"""A browser that reads nothing for this time is disconnected."""
DISPLACED = 4000
"""Code of a web socket that is closed for another browser; the page reconnects later."""
_REQUESTS_PER_S = 20


class BrowserSocket(ABC):
    """Receives the messages of a browser, and sends what a page shows."""

    def __init__(self, socket: WebSocket) -> None:
        self._socket = socket
        self._displaced = asyncio.Event()

    @abstractmethod
    async def heed(self, text: str) -> None:
        """Do what a message of the browser asks for; LivebodeError or KeyError if it is invalid."""

    @abstractmethod
    async def send_news(self) -> None:
        """Send changes until it is cancelled."""

    async def run(self) -> None:
        """Serve until the browser disconnects or exceeds a limit."""
        await self._socket.accept()
        hearing = asyncio.create_task(self._hear())
        saying = asyncio.create_task(self.send_news())
        displaced = asyncio.create_task(self._displaced.wait())
        tasks = {hearing, saying, displaced}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
            if displaced in done:
                await asyncio.wait_for(
                    self._socket.close(DISPLACED, Message("another browser took this place")), SLOW_S
                )
        except (TimeoutError, WebSocketDisconnect, RuntimeError, OSError):
            pass  # it is gone, or too slow
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def displace(self) -> None:
        """Disconnect it: another browser has its place."""
        self._displaced.set()

    async def send(self, news: dict[str, Any]) -> None:
        """Send plain data."""
        await asyncio.wait_for(self._socket.send_text(to_json(news)), SLOW_S)

    async def send_bytes(self, data: bytes) -> None:
        """Send a frame."""
        await asyncio.wait_for(self._socket.send_bytes(data), SLOW_S)

    async def _hear(self) -> None:
        count, since = 0, time.monotonic()
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            now = time.monotonic()
            if now - since > 1:
                count, since = 0, now
            count += 1
            if count > _REQUESTS_PER_S:
                await self._socket.close(1008, Message("too many messages"))
                return
            try:
                if text is None:
                    raise ServerError("request-malformed", "a message is text, not bytes", "send text")
                await self.heed(text)
            except (LivebodeError, KeyError) as error:
                await self.send(error_answer(error))


HEALTH_EVERY_S = 0.5
ROWS_EVERY_S = 0.1
TRENDS_EVERY_S = 0.25
_ROWS_AT_ONCE = 400


class Client(BrowserSocket):
    """Sends the newest data that a browser watches; data for which it is too slow are skipped, never queued."""

    def __init__(self, board: Board, socket: WebSocket, role: str) -> None:
        super().__init__(socket)
        self._board, self._role = board, role
        self._watched = ClientMessage("watch")
        self._restart = True
        self._paused = False
        self._references: dict[int, Responses] = {}
        self._sent: dict[str, Any] = {}

    async def run(self) -> None:
        """Serve until the browser disconnects or exceeds a limit."""
        self._board.pulse_now()
        await super().run()

    async def heed(self, text: str) -> None:
        """Do what a message of the browser asks for."""
        await self._heed(client_message(text, len(self._board.states)))

    async def _heed(self, asked: ClientMessage) -> None:
        if asked.kind == "watch":
            state = self._board.states[asked.axis]
            if asked.quantity and state.quantities is not None:
                state.quantities.check(asked.quantity)
            if asked.axis != self._watched.axis:
                self._references.clear()
            self._watched, self._restart = asked, True
        elif asked.kind in ("pause", "resume"):
            self._paused = asked.kind == "pause"
            for name in ("newest", "fits", "fit_at"):
                self._sent.pop(name, None)
        elif asked.kind == "unfreeze":
            for slot in [asked.slot] if asked.slot else list(self._references):
                self._references.pop(slot, None)
        elif (frozen := await self._frozen(asked)) is not None:
            slot = asked.slot or 1
            self._references[slot] = frozen
            self._sent.pop(reference_kind(slot), None)
        self._board.pulse_now()

    async def _frozen(self, asked: ClientMessage) -> Responses | None:
        state = self._state
        if asked.saved is not None and state.directory is not None:
            saved = (await self._board.elsewhere(read_saved, state.directory)).reference(asked.saved)
            if saved is None:
                raise ServerError(
                    "reference-unknown",
                    f"no reference {asked.saved!r} is saved with this run",
                    Message("reload the page"),
                )
            return saved.response
        if asked.time_s is None or state.newest is None:
            return state.newest
        return await self._board.elsewhere(Past.of(state).at, asked.time_s)

    @property
    def _state(self) -> State:
        return self._board.states[self._watched.axis]

    async def send_news(self) -> None:
        """Send changes until it is cancelled."""
        while True:
            state = self._state
            if self._restart:
                self._restart = False
                self._sent = {"notices": 0, "trends": state.trends.version, "rows": state.recent.count}
                self._sent |= {"runs": state.runs, "finished": state.finished}
                facts = state.facts() | {"role": self._role, "watched": state.shown(self._watched.quantity)}
                trends = state.trends.plain(whole=True)
                await self.send({"facts": facts, "axes": self._board.names, "span": state.span(), "trends": trends})
            elif (self._sent["runs"], self._sent["finished"]) != (state.runs, state.finished):
                self._restart = True
                continue
            await self._update(state)
            await self._board.pulse.wait_next()

    async def _update(self, state: State) -> None:
        """Send all changes, in at most two messages."""
        news: dict[str, Any] = {}
        if state.notices.version != self._sent["notices"]:
            news["notices"] = state.notices.since(self._sent["notices"])
            news["forgotten"] = state.notices.forgotten(self._sent["notices"])
            news["history"] = state.notices.history.since(self._sent["notices"])
            self._sent["notices"] = state.notices.version
        if self._due("health", HEALTH_EVERY_S):
            news |= {"health": self._board.health(state), "span": state.span(), "verdicts": self._board.verdicts()}
        if state.trends.version != self._sent["trends"] and self._due("trend", TRENDS_EVERY_S):
            news["newest"] = state.trends.plain(whole=False)
            self._sent["trends"] = state.trends.version
        if news:
            await self.send(news)
        if data := self._frames(state):
            await self.send_bytes(data)

    def _frames(self, state: State) -> bytes:
        if state.quantities is None or state.newest is None:
            return b""
        quantity, frames = state.shown(self._watched.quantity), b""
        if not self._paused and self._sent.get("newest") != state.version:
            self._sent["newest"] = state.version
            frames += state.newest_frames(quantity)
        if not self._paused and self._sent.get("fits") != state.trends.version and self._due("fit", TRENDS_EVERY_S):
            self._sent["fits"] = state.trends.version
            frames += state.newest_fits(quantity)
        for slot, reference in list(self._references.items()):
            if not state.quantities.fit(reference):
                del self._references[slot]  # it belongs to a previous run
            elif (kind := reference_kind(slot)) not in self._sent:
                self._sent[kind] = True
                frames += frame(kind, state.axis, state.quantities.of_responses(reference, quantity))
        if state.recent.count > self._sent["rows"] and self._due("row", ROWS_EVERY_S):
            rows = state.rows(self._sent["rows"], _ROWS_AT_ONCE)
            self._sent["rows"] = state.recent.count
            if rows is not None:
                frames += frame("rows", state.axis, state.quantities.of_responses(rows, quantity))
        return frames

    def _due(self, kind: str, every_s: float) -> bool:
        now = time.monotonic()
        if now - self._sent.get(f"{kind}_at", -every_s) < every_s:
            return False
        self._sent[f"{kind}_at"] = now
        return True


async def serve_browser(board: Board, socket: WebSocket, client_of: Callable[[Role], BrowserSocket]) -> None:
    """Serve a browser until it disconnects; close the socket of one that may not read, or has no place."""
    address = socket.client.host if socket.client else ""
    try:
        role = board.access.role_of(socket)
    except ServerError:
        role = None
    if role is None:
        await socket.close(1008)
        return
    client = client_of(role)
    place = ClientPlace(role, address, client.displace)
    if not board.places.enter(place):
        await socket.close(1013)
        return
    try:
        await client.run()
    finally:
        board.places.leave(place)
