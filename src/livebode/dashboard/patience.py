"""HTTP by h11 that records since when it waits for the client."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import h11
from starlette.types import Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

REQUEST_S = 10.0
"""Limit for a complete request, head and body, from the connection or its first byte."""
IDLE_S = 30.0
"""Limit between two requests."""
UNREAD_S = 20.0
"""Limit without reading any part of an answer."""


@dataclass(frozen=True)
class ClientWait:
    """How long a connection waits for the client.

    Attributes
    ----------
    since_s
        Start of the wait, by the loop's clock.
    limit_s
        Time limit of the client to send a request or to read its answer; None if it waits for the server or has a web
        socket, and must not be closed.
    """

    since_s: float
    limit_s: float | None

    def over(self, now_s: float) -> bool:
        """Whether the client exceeded its limit."""
        return self.limit_s is not None and now_s - self.since_s > self.limit_s


class PatientProtocol(H11Protocol):
    """`waits` reports what the client must do: send a request or the rest of one, or read its answer."""

    _since_s = _unread_s = 0.0
    _idle = _upgraded = _working = False
    heard = False
    """Whether anything that the client has sent was read."""

    async def _call(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._working = True
        try:
            await self.config.loaded_app(scope, receive, send)
        finally:
            self._working = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._since_s, self.app = self.loop.time(), self._call

    def data_received(self, data: bytes) -> None:
        self.heard = True
        if self._idle:
            self._since_s, self._idle = self.loop.time(), False
        super().data_received(data)

    def on_response_complete(self) -> None:
        self._since_s, self._idle = self.loop.time(), True
        super().on_response_complete()

    def pause_writing(self) -> None:
        self._unread_s = self.loop.time()
        super().pause_writing()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._upgraded = True  # the transport now belongs to another protocol, which has its own limits
        super().handle_websocket_upgrade(event)

    @property
    def answers(self) -> bool:
        """Whether the server works on an answer: the request is complete, and the client reads or has gone."""
        asked: object = self.cycle  # None before the first request, which uvicorn's type omits
        if asked is None or self._upgraded or self.flow.write_paused or self.cycle.response_complete:
            return False
        return self._working if self.cycle.disconnected else not self.cycle.more_body

    @property
    def waits(self) -> ClientWait:
        if self._upgraded:  # the web socket has its own limits
            return ClientWait(self._since_s, None)
        if self.flow.write_paused:
            return ClientWait(self._unread_s, UNREAD_S)
        if self.answers:
            return ClientWait(self._since_s, None)
        return ClientWait(self._since_s, IDLE_S if self._idle else REQUEST_S)
