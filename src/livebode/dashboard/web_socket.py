"""The web socket of uvicorn, whose shutdown failed for a connection that its browser was closing."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from typing import cast

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.protocol import State


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """Under TLS a connection remains for a while after both have said goodbye, and a second goodbye is an error."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the socket: a TLS transport that was closed twice cannot be aborted any more."""
        super().connection_made(cast("asyncio.Transport", transport))
        self._socket = cast("socket.socket", transport.get_extra_info("socket"))

    def shutdown(self) -> None:
        """End the connection, as the server ends."""
        if self.handshake_complete and self.conn.state is not State.OPEN:
            self.stop_keepalive()
            with contextlib.suppress(OSError):  # the browser has closed it at this moment
                self._socket.shutdown(socket.SHUT_RDWR)
        else:
            super().shutdown()
