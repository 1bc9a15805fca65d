"""Who asks too much of the dashboard, too slowly or too often, and that the owner and the run notice nothing of it."""

from __future__ import annotations

import asyncio
import asyncio.sslproto
import contextlib
import gc
import json
import resource
import select
import socket
import ssl
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import uvicorn
import websockets
from uvicorn.server import ServerState
from websockets.asyncio.client import connect as connect_async
from websockets.sync.client import ClientConnection, connect

from livebode.cli.start import OBJECTS_NEW
from livebode.dashboard import Dashboard, ServerSettings, listener, listening
from livebode.dashboard.browser_socket import DISPLACED
from livebode.dashboard.listener import Listener, PatientProtocol, connections_max
from livebode.dashboard.places import PLACES, ClientPlace, Places
from livebode.dashboard.server import Faults
from tests.support.browser import until
from tests.support.dashboards import Watched
from tests.support.guarded import TOKEN, answer, ask, closed, cookie, guarded, origin, port_of
from tests.support.peers.certificates import Authority
from tests.support.peers.peer import PATIENCE_S


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with guarded(tmp_path_factory.mktemp("guarded")) as found:
        yield found


def test_too_many_browsers_and_messages_are_let_go(watched: Watched) -> None:
    url, headers = f"ws://127.0.0.1:{port_of(watched)}/live", {"Cookie": cookie(watched, TOKEN)}

    def opened() -> ClientConnection:
        return connect(url, origin=origin(watched), additional_headers=headers, ping_interval=None, close_timeout=1)

    with contextlib.ExitStack() as stack:
        for _ in range(PLACES):
            stack.enter_context(opened())
        with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
            opened()
    with opened() as live:
        with contextlib.suppress(websockets.exceptions.ConnectionClosed):
            for _ in range(200):
                live.send('{"kind": "pause"}')
        assert closed(live)
    with opened() as live:
        live.send("x" * 100_000)
        assert closed(live)
    with opened() as live:  # a message that means nothing is answered, and no more
        answer(live, "facts")
        live.send("no json")
        assert answer(live, "error") == "the message is not JSON; send an object of JSON"
        live.send(b"\x00\xff")
        assert answer(live, "error") == "a message is text, not bytes; send text"
        live.send('{"kind": "watch"}')
        answer(live, "facts")
    assert not [line for line in watched.messages if "internal error" in line]


def test_held_web_sockets_shut_the_owner_out_of_no_page() -> None:
    """Without a token nobody can show that the page is theirs: the oldest of the crowd goes."""
    with Dashboard(ServerSettings("127.0.0.1", 0)) as dashboard, contextlib.ExitStack() as stack:
        dashboard.hub("axis")
        url = dashboard.url.replace("http", "ws") + "live"

        def opened(address: str = "127.0.0.1") -> ClientConnection:
            near = socket.create_connection(
                ("127.0.0.1", int(dashboard.url.rsplit(":", 1)[1][:-1])), None, (address, 0)
            )
            live = connect(url, sock=near, origin=dashboard.url.rstrip("/"), ping_interval=None, close_timeout=1)
            return stack.enter_context(live)

        held = [opened("127.0.0.2") for _ in range(PLACES)]
        owner = opened()
        answer(owner, "facts")
        assert closed(held[0])
        assert held[0].close_code == DISPLACED
        more = [opened("127.0.0.2") for _ in range(PLACES)]
        owner.send('{"kind": "watch"}')
        assert answer(owner, "facts")
        same = [opened() for _ in range(2)]
        assert answer(same[-1], "facts")
        assert closed(more[0])


def test_an_operator_takes_the_place_of_the_oldest_viewer_and_nobody_that_of_an_operator() -> None:
    gone = list[str]()
    places = Places(open=False)
    viewers = [ClientPlace("viewer", f"192.0.2.{n}", lambda n=n: gone.append(f"viewer {n}")) for n in range(PLACES)]
    assert all(map(places.enter, viewers))
    assert not places.enter(ClientPlace("viewer", "::1", lambda: None))
    operators = [ClientPlace("operator", "::1", lambda n=n: gone.append(f"operator {n}")) for n in range(PLACES + 1)]
    assert [places.enter(one) for one in operators] == [True] * PLACES + [False]
    assert gone == [f"viewer {n}" for n in range(PLACES)]
    places.leave(operators[0])
    assert places.enter(operators[-1])


def test_a_client_that_does_not_read_delays_no_other(watched: Watched) -> None:
    """A socket that is never read fills up; the machine goes on, another browser sees it, memory stays bounded."""
    mine = cookie(watched, TOKEN)
    request = (
        f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port_of(watched)}\r\nOrigin: {origin(watched)}\r\nCookie: {mine}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", port_of(watched))) as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        deaf.sendall(request.encode())
        with connect(
            watched.url.replace("http", "ws") + "live", origin=origin(watched), additional_headers={"Cookie": mine}
        ) as live:
            live.recv()
            for samples in range(6200, 10_001, 200):
                watched.go(samples)
            seen = 0
            until(lambda: bool(live.recv(timeout=PATIENCE_S)), "news")
            for _ in range(40):
                seen += isinstance(live.recv(timeout=PATIENCE_S), bytes)
                if seen > 2:
                    break
            assert seen > 2
    assert watched.hub._values < 1 << 20


def test_heads_that_never_end_are_refused(watched: Watched) -> None:
    with socket.create_connection(("127.0.0.1", port_of(watched))) as long:
        with contextlib.suppress(OSError):
            long.sendall(b"GET / HTTP/1.1\r\nX: " + b"x" * 200_000)
        answer = b""
        with contextlib.suppress(OSError):
            while part := long.recv(4096):
                answer += part
        assert answer == b"" or b" 400 " in answer.split(b"\r\n")[0] + b" "
    assert ask(watched, "/?" + "x" * 2000)[0] == 414
    assert ask(watched, "/login", "POST", b"x" * 10_000, Origin=origin(watched))[0] == 400


def test_a_web_socket_that_is_closed_under_tls_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """As by a reload of the page: its connection is over before a request would have been due."""
    authority, messages = Authority(tmp_path, "authority"), list[str]()
    tls, trust = authority.sign("dashboard"), ssl.create_default_context(cafile=str(authority.file))
    with Dashboard(ServerSettings("127.0.0.1", 0, tls=tls), messages.append) as dashboard:
        dashboard.hub("axis")
        url = dashboard.url.replace("https", "wss") + "live"
        # The blocking client reads and writes one TLS session in two threads, and hangs once in about 1,000.
        join = partial(connect_async, url, origin=dashboard.url.rstrip("/"), ssl=trust)

        async def reload_and_pause() -> str | bytes:
            async with join() as live:
                await live.recv()
            async with join() as live:
                # Only now: a busy machine may need longer for a handshake.
                monkeypatch.setattr(listener, "REQUEST_S", 0.2)
                await asyncio.sleep(1.5)  # the listener has looked at both
                await live.send('{"kind": "pause"}')
                return await live.recv()

        assert "facts" in json.loads(asyncio.run(reload_and_pause()))
    assert messages == []
    assert capfd.readouterr().err == ""


def test_connections_that_end_in_their_handshake_do_not_wait_for_each_other_in_memory(tmp_path: Path) -> None:
    """Each is a cycle with 256 KiB of buffers, and the command line searches for cycles after 100,000 new objects."""
    authority, before = Authority(tmp_path, "authority"), gc.get_threshold()
    tls, trust = authority.sign("dashboard"), ssl.create_default_context(cafile=str(authority.file))
    gc.collect()
    gc.set_threshold(OBJECTS_NEW)
    try:
        with Dashboard(ServerSettings("127.0.0.1", 0, tls=tls)) as dashboard:
            address = "127.0.0.1", int(dashboard.url.rstrip("/").rpartition(":")[2])
            for _ in range(300):
                with socket.create_connection(address, PATIENCE_S) as plain:
                    plain.sendall(b"\x16\x03\x01")
                # One that completes its handshake comes after it.
                with trust.wrap_socket(socket.create_connection(address, PATIENCE_S), server_hostname="127.0.0.1"):
                    pass
            assert sum(isinstance(found, asyncio.sslproto.SSLProtocol) for found in gc.get_objects()) < 150
        assert gc.get_threshold()[0] == OBJECTS_NEW
    finally:
        gc.set_threshold(*before)


def test_a_web_socket_that_its_browser_is_closing_ends_with_the_dashboard(tmp_path: Path) -> None:
    """Under TLS the connection remains until the browser has answered; the thread of the dashboard must not fail."""
    authority = Authority(tmp_path, "authority")
    tls, trust = authority.sign("dashboard"), ssl.create_default_context(cafile=str(authority.file))
    with Dashboard(ServerSettings("127.0.0.1", 0, tls=tls)) as dashboard:
        dashboard.hub("axis")
        host = dashboard.url.removeprefix("https://").rstrip("/")
        address = ("127.0.0.1", int(host.rpartition(":")[2]))
        browser = trust.wrap_socket(socket.create_connection(address, timeout=PATIENCE_S), server_hostname="127.0.0.1")
        browser.sendall(
            f"GET /live HTTP/1.1\r\nHost: {host}\r\nOrigin: https://{host}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        assert b"101" in browser.recv(1 << 16)
        goodbye, answer_of_server = b"\x88\x82\0\0\0\0\x03\xe8", b"\x88\x02\x03\xe8"
        browser.sendall(goodbye)
        received = b""
        while answer_of_server not in received:
            received += browser.recv(1 << 16)
    browser.close()


def test_a_body_that_does_not_come_is_not_waited_for(
    watched: Watched, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(listener, "REQUEST_S", 0.2)
    host = f"127.0.0.1:{port_of(watched)}"
    head = f"POST /login HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: 100\r\n\r\n{{"
    with socket.create_connection(("127.0.0.1", port_of(watched)), timeout=PATIENCE_S) as slow:
        slow.sendall(head.encode())
        assert slow.recv(100) == b""
    assert "internal error" not in " ".join(watched.messages)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(("soft", "most"), [(1024, 128), (256, 64), (16, 8), (resource.RLIM_INFINITY, 128)])
def test_connections_leave_descriptors_for_the_record(monkeypatch: pytest.MonkeyPatch, soft: int, most: int) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (soft, soft))
    assert connections_max() == most


async def _answers(clients: int, *, closed: bool) -> tuple[int, bytes, int]:
    """So many clients have sent a request before the server looks, and an owner after them.

    How many requests were worked on until the owner had an answer, the answer, and how many connections then remain
    after the clients have gone.
    """
    worked = 0

    async def application(_scope: Any, _receive: Any, send: Any) -> None:
        nonlocal worked
        worked += 1
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})

    config = uvicorn.Config(application, lifespan="off", log_config=None)
    config.load()
    state = ServerState()
    with listening(ServerSettings("127.0.0.1", 0)) as server, contextlib.ExitStack() as opened:
        others = [opened.enter_context(socket.create_connection(server.getsockname())) for _ in range(clients)]
        for one in others:
            one.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
            if closed:
                one.close()
        owner = opened.enter_context(socket.create_connection(server.getsockname()))
        owner.setblocking(False)
        owner.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        found = Listener(server, None, lambda: PatientProtocol(config, state, {}), lambda _: None)
        accepting = asyncio.create_task(found.run())
        received = await asyncio.wait_for(asyncio.get_running_loop().sock_recv(owner, 1000), PATIENCE_S)
        until_then = worked
        opened.close()
        while left := sum(connection.open for connection in found._connections):
            await asyncio.sleep(0.01)
        accepting.cancel()
        return until_then, received, left


@pytest.mark.skipif(not hasattr(select, "POLLRDHUP"), reason="the system does not tell who has gone")
def test_requests_of_clients_that_have_gone_are_not_worked_on_before_the_owners() -> None:
    worked, received, left = asyncio.run(_answers(300, closed=True))
    assert received.startswith(b"HTTP/1.1 204")
    assert worked <= 20  # as many as a browser may have sent before it was closed, and the owner's
    assert left == 0


def test_the_newest_of_many_that_wait_are_served_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listener, "_QUEUE_S", -1.0)
    worked, received, left = asyncio.run(_answers(300, closed=False))
    assert received.startswith(b"HTTP/1.1 204")
    assert worked <= 20
    assert left == 0


def test_internal_errors_of_the_server_are_reported_once_a_minute() -> None:
    messages = list[str]()
    faults = Faults(messages.append)
    for _ in range(1000):
        try:
            raise ValueError("odd")
        except ValueError as error:
            faults.report(error)
    assert len(messages) == 1
    assert "internal error in the dashboard: ValueError('odd') at" in messages[0]


def test_the_event_loop_is_quiet() -> None:
    """Starting and stopping leaves no thread and no loop behind."""
    import threading

    before = {t.name for t in threading.enumerate()}
    with Dashboard(ServerSettings("127.0.0.1", 0)):
        pass
    until(lambda: {t.name for t in threading.enumerate()} <= before, "the threads to end")
    with pytest.raises(RuntimeError):
        asyncio.get_running_loop()
