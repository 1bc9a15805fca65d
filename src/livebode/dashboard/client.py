"""The web socket of a browser that watches an axis: updates at its own rate, and its requests."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket

from livebode.core import Responses, ServerError
from livebode.dashboard.browser_socket import BrowserSocket
from livebode.dashboard.frames import frame, reference_kind
from livebode.dashboard.past import Past
from livebode.dashboard.queries import ClientMessage, client_message
from livebode.language import Message
from livebode.records import read_saved

if TYPE_CHECKING:
    from livebode.dashboard.board import Board
    from livebode.dashboard.state import State

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
            self._sent.pop("newest", None)
        elif asked.kind == "unfreeze":
            for slot in [asked.slot] if asked.slot else list(self._references):
                self._references.pop(slot, None)
        elif (found := await self._frozen(asked)) is not None:
            slot = asked.slot or 1
            self._references[slot] = found
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
        quantity, found = state.shown(self._watched.quantity), b""
        if not self._paused and self._sent.get("newest") != state.version:
            self._sent["newest"] = state.version
            found += state.newest_frames(quantity)
        for slot, reference in list(self._references.items()):
            if not state.quantities.fit(reference):
                del self._references[slot]  # it belongs to a previous run
            elif (kind := reference_kind(slot)) not in self._sent:
                self._sent[kind] = True
                found += frame(kind, state.axis, state.quantities.of_responses(reference, quantity))
        if state.recent.count > self._sent["rows"] and self._due("row", ROWS_EVERY_S):
            rows = state.rows(self._sent["rows"], _ROWS_AT_ONCE)
            self._sent["rows"] = state.recent.count
            if rows is not None:
                found += frame("rows", state.axis, state.quantities.of_responses(rows, quantity))
        return found

    def _due(self, what: str, every_s: float) -> bool:
        now = time.monotonic()
        if now - self._sent.get(f"{what}_at", -every_s) < every_s:
            return False
        self._sent[f"{what}_at"] = now
        return True
