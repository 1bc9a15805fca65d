"""The server: uvicorn behind a Listener, its web socket, and the report of its internal errors."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import socket
import time
import traceback
from collections.abc import Callable
from typing import Any, cast

import uvicorn
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.protocol import State

from livebode.dashboard.listener import Listener, PatientProtocol


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


_OBJECTS_NEW = 5_000
"""Most new objects of Python after which cycles are searched while a page is served: a closed connection under TLS is a
cycle with 256 KiB of buffers, and a crowd of them waited for the 100,000 objects of the command line with 600 MB."""
_FAULT_EVERY_S = 60.0
_FAULT_LETTERS_MAX = 300


class Server(uvicorn.Server):
    """A uvicorn server whose connections a Listener accepts.

    Parameters
    ----------
    config
        Configuration of uvicorn.
    listening
        Non-blocking socket.
    report
        Called with messages about closed connections.
    """

    def __init__(self, config: uvicorn.Config, listening: socket.socket, report: Callable[[str], None]) -> None:
        super().__init__(config)
        self._listening, self._report = listening, report
        self._accepting: asyncio.Task[None] | None = None
        self._threshold = gc.get_threshold()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets or [])
        first, *others = self._threshold
        gc.set_threshold(min(first, _OBJECTS_NEW), *others)
        listener = Listener(self._listening, self.config.ssl, self._protocol, self._report)
        self._accepting = asyncio.create_task(listener.run())

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        if self._accepting is not None:
            self._accepting.cancel()
        await super().shutdown(sockets)
        gc.set_threshold(*self._threshold)

    def _protocol(self) -> PatientProtocol:
        return PatientProtocol(self.config, self.server_state, self.lifespan.state)


class Faults:
    """Reports internal errors of the server in one sentence, at most once a minute.

    A traceback for each would let an attacker fill the disk.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._count, self._reported_s = 0, float("-inf")

    def report(self, error: BaseException | None, text: str = "") -> None:
        """Report an error."""
        self._count += 1
        now_s = time.monotonic()
        if now_s - self._reported_s < _FAULT_EVERY_S:
            return
        self._reported_s = now_s
        frames = traceback.extract_tb(error.__traceback__) if error is not None else []
        place = f" at {frames[-1].filename}:{frames[-1].lineno}" if frames else ""
        often = f", the {self._count}th" if self._count > 1 else ""
        about = (text or repr(error))[:_FAULT_LETTERS_MAX]  # an error may contain the data that it is about
        self._report(f"internal error in the dashboard{often}: {about}{place}; the run continues")

    def handler(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handler for `loop.set_exception_handler`."""
        error = context.get("exception")
        self.report(error, f"{context.get('message', '')} ({error!r})")
