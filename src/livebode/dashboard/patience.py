"""A connection that does not say what it wants within some seconds is closed."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

REQUEST_S = 10.0


class PatientProtocol(H11Protocol):
    """HTTP by h11, for as long as a request's head takes that is not sent byte by byte."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._impatience = self.loop.call_later(REQUEST_S, self._lose_patience)

    def connection_lost(self, exc: Exception | None) -> None:
        self._impatience.cancel()
        super().connection_lost(exc)

    def _lose_patience(self) -> None:
        # With a web socket the transport belongs to another protocol by now; uvicorn has no word for "no request yet".
        owner: object = self.transport.get_protocol()
        asked: object = self.cycle
        if asked is None and owner is self:
            self.transport.close()
