"""The start page of a directory, and what a person or a program sends to it."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from livebode.dashboard import Dashboard, ServerSettings
from tests.support.browser import Tab
from tests.support.peers.peer import PATIENCE_S

CHANNELS = {"excitation": "torque_offset", "input": "torque", "output": "motor_speed"}


@contextlib.contextmanager
def start_page(folder: Path, serving: ServerSettings | None = None) -> Iterator[str]:
    """Address of the start page of a directory."""
    dashboard = Dashboard(serving or ServerSettings("127.0.0.1", 0))
    dashboard.view_all(folder)
    with dashboard:
        yield dashboard.url


def send(url: str, path: str, data: bytes, token: str = "", **headers: str) -> tuple[int, Any]:
    """Status and JSON of a POST of these bytes, as the page sends it."""
    parts = urlsplit(url)
    connection = HTTPConnection(parts.hostname or "", parts.port, timeout=PATIENCE_S)
    sent = {"Origin": url.rstrip("/")} | ({"Authorization": f"Bearer {token}"} if token else {}) | headers
    connection.request("POST", path, data, sent)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, json.loads(text) if "json" in (answer.getheader("content-type") or "") else text


def drop(tab: Tab, log: Path) -> None:
    """Choose a file as a person does, and wait until it can be measured."""
    tab.page.set_input_files("#file", log)
    tab.page.wait_for_url("**/measure**")
    tab.page.wait_for_selector("#measure:enabled")
