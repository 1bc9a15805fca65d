"""The web socket of a browser: its limits, and the end of one that is slow, loud or displaced."""

from __future__ import annotations

import asyncio
import time
from abc import ABC, abstractmethod
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from livebode.core import LivebodeError, ServerError
from livebode.dashboard.access import error_answer
from livebode.language import Message
from livebode.records import to_json

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
