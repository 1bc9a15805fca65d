"""Guard: checks of every request before it is processed, and security headers of every answer."""

from __future__ import annotations

import ipaddress
from collections.abc import AsyncIterator
from typing import Any
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

BODY_BYTES_MAX = 4096
EXPECT_UPLOAD = "livebode.expect_upload"
"""Key of the scope of a request: a function that gives a client its time for each part of the body."""
_QUERY_MAX = 1024
_YEAR_S = 365 * 86400
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}


class Guard:
    """Rejects other host names and origins, long queries and bodies; sets the headers of every answer.

    A page of another origin can send requests with the browser's cookie; it has the wrong Origin. After DNS rebinding
    to this address it can even read the answers; it has the wrong Host.
    """

    def __init__(self, app: ASGIApp, names: tuple[str, ...] = (), tls: bool = False) -> None:
        self._app = app
        self._names = {name.casefold() for name in (*names, "localhost")}
        self._scheme = "https" if tls else "http"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        why = self._wrong(scope)
        if why:
            await _refuse(scope, receive, _with_headers(send, self._scheme == "https"), *why)
            return
        await self._app(scope, receive, _with_headers(send, self._scheme == "https"))

    def _wrong(self, scope: Scope) -> tuple[int, str] | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if len(headers.getlist("host")) != 1 or not self._known(host):
            return 421, "this host name is not served here; add it to serve.names"
        if len(scope.get("query_string", b"")) > _QUERY_MAX:
            return 414, "the query is too long"
        changes = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        origin = headers.get("origin")
        if origin is None:
            # A browser sends the origin with every change; a program that sends a token has no cookie.
            allowed = not changes or headers.get("authorization", "") != ""
        else:
            allowed = origin == f"{self._scheme}://{host}"
        if not allowed or headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
            if changes or origin is not None:
                return 403, "requests from other origins are refused"
            # Links from other pages are allowed; all other requests must come from the page itself.
            if headers.get("sec-fetch-mode") != "navigate":
                return 403, "requests from other origins are refused"
        return None

    def _known(self, host: str) -> bool:
        """Whether the host is this server: DNS rebinding can change a name, but not a numeric address."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
            _ = urlsplit(f"//{host}").port
        except ValueError:
            return False
        if any(c in host for c in "/@?#\\ "):
            return False
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return name.casefold() in self._names
        return True


def _with_headers(send: Send, tls: bool) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)  # a report has a policy of its own
            if tls:
                headers["strict-transport-security"] = f"max-age={_YEAR_S}"
            headers.setdefault("cache-control", "no-store")
        await send(message)

    return send_with_headers


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, why: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": why[:100]})
        return
    await PlainTextResponse(why + "\n", status)(scope, receive, send)


async def upload(request: Any) -> AsyncIterator[bytes]:
    """The parts of a long body, which may take as long as there is one every ten seconds.

    Raises
    ------
    ClientDisconnect
        If the client has gone before the end.
    """
    request.scope[EXPECT_UPLOAD]()
    async for part in request.stream():
        yield part


async def body(request: Any, bytes_max: int = BODY_BYTES_MAX) -> bytes | None:
    """The body of a request; None if it is too long or incomplete."""
    data = b""
    try:
        async for part in request.stream():
            data += part
            if len(data) > bytes_max:
                return None
    except ClientDisconnect:
        return None
    return data
