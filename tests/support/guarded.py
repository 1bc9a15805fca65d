"""A dashboard with tokens, and how a test asks it."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any

import websockets
from websockets.sync.client import ClientConnection

from livebode.dashboard import ServerSettings
from tests.support.dashboards import Watched
from tests.support.peers.peer import PATIENCE_S

TOKEN, VIEWER = "operator-" + "x" * 40, "viewer-" + "y" * 40


@contextlib.contextmanager
def guarded(folder: Path) -> Iterator[Watched]:
    """With tokens, on the loopback."""
    serving = ServerSettings("127.0.0.1", 0, token=TOKEN, viewer_token=VIEWER)
    with Watched(folder / "run", serving) as found:
        found.go(6000)
        yield found


def port_of(watched: Watched) -> int:
    return int(re.search(r":(\d+)/", watched.url).group(1))


def ask(
    watched: Watched, path: str, method: str = "GET", body: Any = None, **headers: str
) -> tuple[int, dict[str, str], str]:
    """Status, headers and body; nothing is sent that is not named, but Host."""
    connection = HTTPConnection("127.0.0.1", port_of(watched), timeout=PATIENCE_S)
    names = {k.replace("_", "-"): v for k, v in headers.items()}
    data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
    connection.request(method, path, data, names)
    answer: HTTPResponse = connection.getresponse()
    found = answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read().decode("utf-8", "replace")
    connection.close()
    return found


def origin(watched: Watched) -> str:
    return watched.url.rstrip("/")


def login(watched: Watched, token: str) -> tuple[int, str]:
    status, headers, _ = ask(watched, "/login", "POST", {"token": token}, Origin=origin(watched))
    return status, headers.get("set-cookie", "")


def cookie(watched: Watched, token: str) -> str:
    status, cookies = login(watched, token)
    assert status == 200
    return cookies.partition(";")[0]


def closed(live: ClientConnection) -> bool:
    """Whether the server closes it, within what it has sent."""
    try:
        for _ in range(60):
            live.recv(timeout=PATIENCE_S)
    except websockets.exceptions.ConnectionClosed:
        return True
    return False


def answer(live: ClientConnection, word: str) -> Any:
    """What stands under this word in the next message that has it."""
    for _ in range(200):
        message = live.recv(timeout=PATIENCE_S)
        if isinstance(message, str) and word in (cookies := json.loads(message)):
            return cookies[word]
    raise AssertionError(f"no message said {word!r}")
