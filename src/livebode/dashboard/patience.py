"""HTTP by h11 that knows since when it waits for the other side."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

REQUEST_S = 10.0
"""For a whole request, head and body, from the connection or its first byte."""
IDLE_S = 30.0
"""Between two requests."""
UNREAD_S = 20.0
"""Without reading any of an answer."""


@dataclass(frozen=True)
class Waiting:
    """What a connection waits for.

    Attributes
    ----------
    since_s
        Since when, by the loop's clock.
    limit_s
        How long the other side may take to ask, or to read its answer; None where it waits for the server, or has a
        web socket, and is not to be closed.
    """

    since_s: float
    limit_s: float | None

    def over(self, now_s: float) -> bool:
        """Whether the other side took too long."""
        return self.limit_s is not None and now_s - self.since_s > self.limit_s


class PatientProtocol(H11Protocol):
    """`waits` says whether the other side owes something: a request, the rest of one, or to read its answer."""

    _since_s = _unread_s = 0.0
    _idle = _upgraded = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._since_s = self.loop.time()

    def data_received(self, data: bytes) -> None:
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
        self._upgraded = True  # the transport is another protocol's from here on, and that has limits of its own
        super().handle_websocket_upgrade(event)

    @property
    def waits(self) -> Waiting:
        if self._upgraded:  # it has limits of its own
            return Waiting(self._since_s, None)
        if self.flow.write_paused:
            return Waiting(self._unread_s, UNREAD_S)
        asked: object = self.cycle  # None before the first request, which uvicorn's type does not say
        if asked is not None and not self.cycle.response_complete and not self.cycle.more_body:
            return Waiting(self._since_s, None)
        return Waiting(self._since_s, IDLE_S if self._idle else REQUEST_S)
