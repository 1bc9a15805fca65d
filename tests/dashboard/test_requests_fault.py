"""Rubbish to the dashboard: malformed queries, messages and requests never crash it, and never fill its memory.

LIVEBODE_DASHBOARD_FUZZ=1000000 runs as many cases of each parser (`make fuzz`).
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import socket
from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from livebode.core import LivebodeError
from livebode.dashboard import Dashboard, ServerSettings, alarm_request, queries
from tests.support.dashboards import Watched
from tests.support.peers.peer import PATIENCE_S

CASES = int(os.environ.get("LIVEBODE_DASHBOARD_FUZZ", "4000"))
_WORDS = [
    *(
        "watch",
        "freeze",
        "pause",
        "plant",
        "open loop",
        "kind",
        "axis",
        "quantity",
        "time_s",
        "null",
        "NaN",
        "Infinity",
    ),
    *(
        "Infinity",
        "-1",
        "1e999",
        "1e-400",
        "9" * 400,
        "0x10",
        "²",
        "\0",
        "\ud800",
        "é",
        "true",
        "[]",
        "{}",
        "csv",
        "mat",
        " ",
        "",
    ),
]


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with Watched(tmp_path_factory.mktemp("hostile") / "run") as found:
        found.go(4000)
        yield found


def anything(rng: random.Random, depth: int = 0) -> object:
    """A value of JSON."""
    pick = rng.random()
    if depth < 3 and pick < 0.25:
        return {rng.choice(_WORDS): anything(rng, depth + 1) for _ in range(rng.randrange(5))}
    if depth < 3 and pick < 0.35:
        return [anything(rng, depth + 1) for _ in range(rng.randrange(5))]
    return rng.choice(
        [rng.choice(_WORDS), rng.randrange(-5, 5), rng.uniform(-1e3, 1e3), 10 ** rng.randrange(400), float("nan"),
         float("inf"), None, True, False]
    )  # fmt: skip


def message(rng: random.Random) -> str:
    """A message that is nearly right, or wholly wrong."""
    pick = rng.random()
    if pick < 0.5:
        kind = rng.choice(["watch", "freeze", "pause", "resume", "unfreeze"])
        request = {
            "kind": kind,
            "axis": rng.choice([0, anything(rng)]),
            "quantity": rng.choice(["plant", anything(rng)]),
        }
        request |= {"slot": rng.choice([1, 8, anything(rng)]), "saved": rng.choice([None, "12345678", anything(rng)])}
        text = json.dumps(request | {"time_s": rng.choice([1.0, anything(rng)])})
    elif pick < 0.8:
        text = json.dumps(anything(rng))
    else:
        text = "".join(rng.choice(_WORDS) for _ in range(rng.randrange(20))) or "[" * rng.randrange(3000)
    if rng.random() < 0.2 and text:
        at = rng.randrange(len(text))
        text = text[:at] + chr(rng.randrange(0x300)) + text[at + rng.randrange(3) :]
    return text


def test_random_messages_are_understood_or_refused() -> None:
    rng, understood = random.Random(1), 0
    for _ in range(CASES):
        with contextlib.suppress(LivebodeError):
            found = queries.client_message(message(rng), axes=2)
            assert found.axis in (0, 1)
            assert found.time_s is None or abs(found.time_s) <= 1e12
            understood += 1
    assert understood > CASES / 20


def test_random_queries_are_understood_or_refused() -> None:
    rng, understood = random.Random(2), 0
    usual = {"axis": "0", "quantity": "plant", "from": "0.5", "to": "1.5", "rows": "100", "format": "csv"}
    for _ in range(CASES):
        query = dict(usual)
        for name in usual:
            if rng.random() < 0.15:
                query[name] = rng.choice([rng.choice(_WORDS), str(rng.uniform(-1e13, 1e13)), str(rng.randrange(-9, 9))])
        with contextlib.suppress(LivebodeError):
            found = queries.span(query, axes=2)
            assert found.axis in (0, 1)
            assert -1e12 <= found.from_s <= found.to_s <= 1e12
            assert 1 <= found.rows <= 1 << 20
            understood += 1
    assert understood > CASES / 20


def test_random_bodies_are_understood_or_refused() -> None:
    rng = random.Random(3)
    for _ in range(CASES):
        data = message(rng).encode("utf-8", "surrogatepass")
        with contextlib.suppress(LivebodeError):
            found = alarm_request(data, axes=2, act=rng.choice(["acknowledge", "shelve", "unshelve"]))
            assert found.axis in (0, 1)
            assert len(found.event) <= 64
        with contextlib.suppress(LivebodeError):
            change = queries.saved_change(data, axes=2)
            assert change.axis in (0, 1)
            assert change.kind in ("reference", "annotation", "remove")
            assert 0 < len(change.text) <= 200


def port_of(watched: Watched) -> int:
    return int(watched.url.rsplit(":", 1)[1].strip("/"))


def head(rng: random.Random, port: int) -> bytes:
    """A request that is nearly right."""
    paths = [
        "/",
        "/api/past",
        "/api/moment",
        "/api/signals",
        "/api/export",
        "/api/acknowledge",
        "/api/shelve",
        "/live",
        "/login",
        "/static/x",
        "*",
    ]
    names = ["axis", "from", "to", "quantity", "rows", "format", "picture", "at"]
    query = "&".join(f"{rng.choice(names)}={rng.choice(_WORDS)}" for _ in range(rng.randrange(4)))
    method, version = rng.choice(["GET", "GET", "POST", "HEAD", "PUT", "X"]), rng.choice(["1.1", "1.1", "1.0", "9", ""])
    lines = [
        f"{method} {rng.choice(paths)}?{query} HTTP/{version}",
        f"Host: {rng.choice([f'127.0.0.1:{port}'] * 4 + ['evil', '', '[', 'a:b:c'])}",
        f"Origin: {rng.choice([f'http://127.0.0.1:{port}', 'null', ''])}",
        f"Content-Length: {rng.choice(['0', '0', '5', '-1', 'x', '99999999999'])}",
        f"Content-Type: {rng.choice(['application/json', '', 'x' * 50])}",
        f"Cookie: {rng.choice(['livebode=x', ';;;', '=', 'a' * 300])}",
        f"Authorization: {rng.choice(['Bearer x', 'Bearer', 'Basic eDp4', ''])}",
        f"Upgrade: {rng.choice(['websocket', 'h2c', ''])}",
        f"Connection: {rng.choice(['Upgrade', 'close', ''])}",
        f"Sec-WebSocket-Version: {rng.choice(['13', '8', ''])}",
        f"Sec-WebSocket-Key: {rng.choice(['dGhlIHNhbXBsZSBub25jZQ==', 'x', ''])}",
    ]
    chosen = [lines[0], *(line for line in lines[1:] if rng.random() < 0.6)]
    data = "\r\n".join(chosen).encode("utf-8", "replace") + b"\r\n\r\n" + rng.randbytes(rng.randrange(40))
    if rng.random() < 0.3:
        at = rng.randrange(len(data))
        data = data[:at] + rng.randbytes(3) + data[at + 1 :]
    return data


def test_random_requests_do_not_stop_the_server(watched: Watched, capfd: pytest.CaptureFixture[str]) -> None:
    rng, port, statuses = random.Random(4), port_of(watched), {}
    for _ in range(min(CASES, 20_000) // 10):
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as one:
            one.sendall(head(rng, port))
            one.shutdown(socket.SHUT_WR)
            with contextlib.suppress(OSError):
                status = one.recv(12)[9:12]
                statuses[status] = statuses.get(status, 0) + 1
    assert b"500" not in statuses, statuses
    assert {b"400", b"200"} <= set(statuses)
    assert "Traceback" not in capfd.readouterr().err
    watched.go(watched.hub.samples + 400)
    assert watched.dashboard._server.started


def test_messages_leave_the_socket_or_close_it(watched: Watched, capfd: pytest.CaptureFixture[str]) -> None:
    rng, url = random.Random(5), watched.url.replace("http", "ws") + "live"
    for _ in range(12):
        with connect(url, origin=watched.url.rstrip("/"), close_timeout=1) as live:
            live.recv()
            with contextlib.suppress(ConnectionClosed, UnicodeEncodeError):
                for _ in range(15):
                    text = message(rng)
                    live.send(rng.choice([text, text.encode("utf-8", "replace")]))
    with connect(url, origin=watched.url.rstrip("/")) as live:
        assert "facts" in json.loads(live.recv())
    assert "Traceback" not in capfd.readouterr().err


def test_a_record_that_cannot_be_read_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LivebodeError, match="not the directory of a run"):
        Dashboard(ServerSettings("127.0.0.1", 0)).view(tmp_path)


_CALLS: list[tuple[str, dict[str, object]]] = [
    ("/login", {"token": "TEXT"}),
    ("/logout", {"TEXT": "TEXT"}),
    ("/api/acknowledge", {"axis": 0, "event": "TEXT", "by": "TEXT", "comment": "TEXT"}),
    ("/api/shelve", {"axis": 0, "event": "TEXT", "by": "TEXT", "reason": "TEXT", "minutes": 5}),
    ("/api/unshelve", {"axis": 0, "event": "3f", "by": "TEXT"}),
    ("/api/saved", {"axis": 0, "kind": "annotation", "text": "TEXT", "frequency_hz": 62.5}),
    ("/api/saved", {"axis": 0, "kind": "reference", "text": "TEXT", "time_s": 1.0}),
    ("/api/saved", {"axis": 0, "kind": "remove", "text": "TEXT"}),
    ("/api/saved", {"axis": 0, "kind": "TEXT", "text": "TEXT", "TEXT": 1}),
    ("/api/notes", {"run": "run", "tags": ["TEXT"], "text": "TEXT"}),
    ("/api/notes", {"run": "TEXT", "tags": [], "text": "TEXT"}),
    ("/api/delete", {"run": "TEXT", "confirmed": "TEXT"}),
]
_TEXTS = st.one_of(
    st.text(alphabet=st.characters(), max_size=30),
    st.text(alphabet=st.characters(categories=("Cc", "Cf", "Cs", "Co", "Zl", "Zp")), min_size=1, max_size=8),
    st.sampled_from(
        ["\ud800", "a\udfff", "\0", "\x1b[2J", "\u202e", "x" * 3000, "x" * 100_000, "\uffff", "🙂" * 900, ""]
    ),
)


@pytest.fixture(scope="module")
def all_runs(watched: Watched) -> Iterator[tuple[str, list[str]]]:
    """The page of all runs, and what the dashboard reports on the terminal."""
    messages = list[str]()
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0), messages.append)
    dashboard.view_all(watched.directory.parent)
    with dashboard:
        yield dashboard.url, messages


@given(st.sampled_from(_CALLS), _TEXTS, st.booleans())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_is_stored_or_refused_in_a_sentence(
    watched: Watched, all_runs: tuple[str, list[str]], call: tuple[str, dict[str, object]], text: str, escaped: bool
) -> None:
    """Escaped or as bytes; what was stored is read back, so that no later request fails by it."""
    path, body = call
    url, messages = all_runs if path in ("/api/notes", "/api/delete") else (watched.url, watched.messages)
    words = json.dumps(body).replace("TEXT", json.dumps(text)[1:-1])
    data = words if escaped else json.dumps(json.loads(words), ensure_ascii=False)
    headers = {"Origin": url.rstrip("/"), "Content-Type": "application/json"}
    with closing(HTTPConnection("127.0.0.1", int(url.rsplit(":", 1)[1].strip("/")), timeout=PATIENCE_S)) as connection:
        connection.request("POST", path, data.encode("utf-8", "surrogatepass"), headers)
        answer = connection.getresponse()
        content = answer.read().decode()
        assert answer.status in (200, 202, 400, 401, 404, 429), (path, text, content)
        if answer.status >= 400:
            assert len(json.loads(content)["error"]) < 500
        elif path == "/api/saved":
            connection.request("GET", "/api/saved?axis=0")
            assert connection.getresponse().read().decode() == content
    assert not [line for line in messages if "internal error" in line]
    assert all(letter.isprintable() or letter == "\n" for line in messages for letter in line)
