"""Admission of browsers to a live page: who may read it, and for whom there is a place."""

from __future__ import annotations

from collections.abc import Callable

from starlette.websockets import WebSocket

from livebode.core import ServerError
from livebode.dashboard.access import Role
from livebode.dashboard.board import Board
from livebode.dashboard.browser_socket import BrowserSocket
from livebode.dashboard.places import ClientPlace


async def serve_browser(board: Board, socket: WebSocket, client_of: Callable[[Role], BrowserSocket]) -> None:
    """Serve a browser until it disconnects; close the socket of one that may not read, or has no place."""
    headers, address = socket.headers, socket.client.host if socket.client else ""
    try:
        role = board.access.role(headers.get("cookie", ""), headers.get("authorization", ""), address)
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
