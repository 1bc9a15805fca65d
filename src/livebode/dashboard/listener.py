"""Listener: accepts connections, and limits them so that the record has descriptors and the owner a connection."""

from __future__ import annotations

import asyncio
import contextlib
import select
import socket
import ssl
import sys
from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import Any

import h11
from starlette.types import Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from livebode.dashboard.access import network
from livebode.dashboard.guard import EXPECT_UPLOAD
from livebode.dataclass import dataclass

REQUEST_S = 10.0
"""Limit for a complete request, head and body, from the connection or its first byte; of an upload for each part."""
IDLE_S = 30.0
"""Limit between two requests."""
UNREAD_S = 20.0
"""Limit without reading any part of an answer."""


@dataclass(frozen=True)
class ClientWait:
    """How long a connection waits for the client.

    Attributes
    ----------
    since_s
        Start of the wait, by the loop's clock.
    limit_s
        Time limit of the client to send a request or to read its answer; None if it waits for the server or has a web
        socket, and must not be closed.
    """

    since_s: float
    limit_s: float | None

    def over(self, now_s: float) -> bool:
        """Whether the client exceeded its limit."""
        return self.limit_s is not None and now_s - self.since_s > self.limit_s


class PatientProtocol(H11Protocol):
    """`waits` reports what the client must do: send a request or the rest of one, or read its answer."""

    _since_s = _unread_s = 0.0
    _idle = _upgraded = _working = False
    _uploads = False
    heard = False
    """Whether anything that the client has sent was read."""

    async def _call(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._working = True
        scope[EXPECT_UPLOAD] = self._expect_upload
        try:
            await self.config.loaded_app(scope, receive, send)
        finally:
            self._working = False

    def _expect_upload(self) -> None:
        self._uploads, self._since_s = True, self.loop.time()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._since_s, self.app = self.loop.time(), self._call

    def data_received(self, data: bytes) -> None:
        self.heard = True
        if self._idle or self._uploads:
            self._since_s, self._idle = self.loop.time(), False
        super().data_received(data)

    def on_response_complete(self) -> None:
        self._since_s, self._idle, self._uploads = self.loop.time(), True, False
        super().on_response_complete()

    def pause_writing(self) -> None:
        self._unread_s = self.loop.time()
        super().pause_writing()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._upgraded = True  # the transport now belongs to another protocol, which has its own limits
        super().handle_websocket_upgrade(event)

    @property
    def answers(self) -> bool:
        """Whether the server works on an answer: the request is complete, and the client reads or has gone."""
        asked: object = self.cycle  # None before the first request, which uvicorn's type omits
        if asked is None or self._upgraded or self.flow.write_paused or self.cycle.response_complete:
            return False
        return self._working if self.cycle.disconnected else not self.cycle.more_body

    @property
    def waits(self) -> ClientWait:
        if self._upgraded:  # the web socket has its own limits
            return ClientWait(self._since_s, None)
        if self.flow.write_paused:
            return ClientWait(self._unread_s, UNREAD_S)
        if self.answers:
            return ClientWait(self._since_s, None)
        return ClientWait(self._since_s, IDLE_S if self._idle else REQUEST_S)


CONNECTIONS_MAX = 128
HANDSHAKE_S = 10.0
"""Limit for the first byte and the TLS handshake."""
_DESCRIPTORS_PER_CONNECTION = 4  # the connection and a file that it receives; as many are reserved for the record
_SWEEP_S = 1.0
_SENTENCE_S = 60.0
_REST_S = 0.2  # where accepting fails for want of descriptors, an immediate retry fails too
_Accepted = tuple[socket.socket, Any]
_ROUND = 8
"""Connections that are taken at once, so that all their requests are read: more than a browser opens."""
_QUEUE_S = 2.0
"""Time until a queue that never was empty is emptied, and only its newest connections are taken."""
_AT_ONCE, _LONG_S, _TURN_S = 3, 1.0, 0.002
"""Requests of an address that are worked on at once, but for those that take longer; time between two looks."""
_ROUND_S = 0.2
"""Longest time to read the requests of connections that were accepted together, before the next ones are."""
_STEPS = 4
"""Turns of the loop until a request is read: transport, reader, data, task."""


def connections_max() -> int:
    """Largest number of connections, from the process's limit of descriptors (RLIMIT_NOFILE)."""
    if sys.platform == "win32":
        return CONNECTIONS_MAX
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY:
        return CONNECTIONS_MAX
    return max(8, min(CONNECTIONS_MAX, soft // _DESCRIPTORS_PER_CONNECTION))


class _Connection:
    """An accepted connection. Its transport closes the socket."""

    def __init__(self, taken: socket.socket, address: str, since_s: float) -> None:
        self.socket, self.address, self.since_s = taken, address, since_s
        self.asks = False
        """Whether the client has sent something."""
        self.protocol: PatientProtocol | None = None  # known after the TLS handshake
        self.serving: asyncio.Task[None] | None = None

    @property
    def open(self) -> bool:
        return self.socket.fileno() >= 0

    @property
    def waits(self) -> ClientWait:
        return ClientWait(self.since_s, HANDSHAKE_S) if self.protocol is None else self.protocol.waits

    @property
    def unread(self) -> bool:
        """Whether the client has sent something, and nothing of it was read."""
        return self.asks and (self.protocol is None or not self.protocol.heard)

    @property
    def left_work(self) -> bool:
        """Whether the client has gone, and the server still works on its request."""
        return not self.open and self.protocol is not None and self.protocol.answers

    def drop(self) -> None:
        if self.protocol is not None:
            self.protocol.transport.abort()
        elif self.serving is not None:
            self.serving.cancel()
        else:
            asyncio.get_running_loop().remove_reader(self.socket)
            self.socket.close()


class Listener:
    """Accepts connections and hands them to the server's protocol.

    Where many wait, those whose client has gone are closed unread, and the newest ones are served first: a client that
    waits is among them, however many connections came and went before it.

    At most `connections_max` are open, half of them from one address. If there is no room, the connection that has
    waited longest without a complete request is closed for the new one: a client with many connections cannot exclude
    others, not even the owner behind the same address. A connection without a request is closed after a time limit.

    Parameters
    ----------
    listening
        Non-blocking socket.
    tls
        None for plain HTTP.
    protocol
        Creates the protocol of a connection.
    report
        Called at most once a minute with the number of connections that were closed for others.
    """

    def __init__(
        self,
        listening: socket.socket,
        tls: ssl.SSLContext | None,
        protocol: Callable[[], PatientProtocol],
        report: Callable[[str], None],
    ) -> None:
        self._socket, self._tls, self._protocol, self._report = listening, tls, protocol, report
        self._most = connections_max()
        self._connections: list[_Connection] = []
        self._left: list[_Connection] = []
        self._asking: list[_Connection] = []
        self._crowded = False
        self._asked, self._all_read = asyncio.Event(), asyncio.Event()
        self._all_read.set()
        self._closed: Counter[str] = Counter()
        self._reported_s = float("-inf")

    async def run(self) -> None:
        """Accept connections until it is cancelled."""
        loop = asyncio.get_running_loop()
        tasks = [loop.create_task(self._sweep()), loop.create_task(self._hand_over())]
        crowded_s = loop.time()
        try:
            while True:
                try:
                    first = await loop.sock_accept(self._socket)
                except OSError:  # the client has gone, or another part used up the descriptors
                    await asyncio.sleep(_REST_S)
                    continue
                if not self._crowded:
                    crowded_s = loop.time()
                accepted = self._accepted(first, all_of_them=loop.time() - crowded_s > _QUEUE_S)
                self._crowded = len(accepted) >= _ROUND
                self._add(accepted)
                # Else the next ones would take the places of these before their requests are read.
                await asyncio.sleep(0)  # until `_ask` has been called for them
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._all_read.wait(), _ROUND_S)
        finally:
            for task in tasks:
                task.cancel()
            self._report_closed(float("inf"))

    def _accepted(self, first: _Accepted, *, all_of_them: bool) -> Sequence[_Accepted]:
        """The first connections that wait to be accepted, or the newest ones of all.

        In a crowd those whose client has gone are closed.
        """
        kept = deque([first], self._most)
        while all_of_them or len(kept) < _ROUND:
            try:
                taken, address = self._socket.accept()
            except OSError:
                break
            taken.setblocking(False)
            if self._crowded and _gone(taken):
                taken.close()
                continue
            if len(kept) == self._most:
                oldest, place = kept.popleft()
                oldest.close()
                self._closed[network(str(place[0]))] += 1
            kept.append((taken, address))
        return kept

    def _add(self, accepted: Sequence[_Accepted]) -> None:
        """Add connections, and close others, or some of them, where there are too many."""
        loop = asyncio.get_running_loop()
        self._left = [connection for connection in self._left + self._connections if connection.left_work]
        self._connections = [connection for connection in self._connections if connection.open]
        for taken, address in accepted:
            connection = _Connection(taken, network(str(address[0])), loop.time())
            connection.asks = self._crowded and _has_sent(taken)
            loop.add_reader(taken, self._ask, connection)
            self._connections.append(connection)
        for address in {connection.address for connection in self._connections}:
            crowd = [connection for connection in self._connections if connection.address == address]
            self._make_room(crowd, self._most // 2)
        self._make_room(self._connections, self._most)

    def _make_room(self, crowd: list[_Connection], most: int) -> None:
        """Close connections until there are no more than this: first those that waited longest without a request."""
        excess = len(crowd) - most
        if excess <= 0:
            return
        waits = [connection.waits for connection in crowd]
        closable = sorted(
            (crowd[i].unread, wait.since_s, i) for i, wait in enumerate(waits) if wait.limit_s is not None
        )
        refused = {crowd[i] for *_, i in closable[:excess]}  # enough: those that are new have no request yet
        for connection in refused:
            self._closed[connection.address] += 1
            connection.drop()
        self._connections = [connection for connection in self._connections if connection not in refused]

    def _ask(self, connection: _Connection) -> None:
        """The client has sent something, or has gone."""
        asyncio.get_running_loop().remove_reader(connection.socket)
        try:
            gone = connection.socket.recv(1, socket.MSG_PEEK) == b""
        except OSError:
            gone = True
        if gone:
            connection.socket.close()
            return
        connection.asks = True
        self._asking.append(connection)
        self._all_read.clear()
        self._asked.set()

    async def _hand_over(self) -> None:
        """Hand connections that have sent something to the server, the newest one first, one at a time."""
        loop = asyncio.get_running_loop()
        while True:
            await self._asked.wait()
            self._asked.clear()
            while self._asking:
                connection = self._next(loop.time())
                if connection is None:
                    await asyncio.sleep(_TURN_S)
                elif self._crowded and _gone(connection.socket):
                    connection.socket.close()
                else:
                    connection.serving = loop.create_task(self._serve(connection))
                    for _ in range(_STEPS):
                        await asyncio.sleep(0)
            self._all_read.set()

    def _next(self, now_s: float) -> _Connection | None:
        """The newest connection that asks, of an address for which the server does not work on enough requests."""
        self._asking = [connection for connection in self._asking if connection.open]
        working = Counter(
            connection.address
            for connection in (*self._connections, *self._left)
            if connection.protocol is not None
            and connection.protocol.answers
            and now_s - connection.protocol.waits.since_s < _LONG_S
        )
        for index in reversed(range(len(self._asking))):
            if working[self._asking[index].address] < _AT_ONCE:
                return self._asking.pop(index)
        return None

    async def _serve(self, connection: _Connection) -> None:
        loop, limit_s = asyncio.get_running_loop(), None if self._tls is None else HANDSHAKE_S
        try:
            # No protocol before the first byte; with TLS it takes a quarter of a megabyte.
            _, connection.protocol = await loop.connect_accepted_socket(
                self._protocol,
                connection.socket,
                ssl=self._tls,
                ssl_handshake_timeout=limit_s,
                ssl_shutdown_timeout=limit_s,
            )
        except OSError:  # the client has gone, or the TLS handshake failed
            connection.socket.close()
        except asyncio.CancelledError:
            connection.socket.close()
            raise

    async def _sweep(self) -> None:
        """Close connections that wait too long; report those that were closed for others."""
        clock = asyncio.get_running_loop().time
        while True:
            await asyncio.sleep(_SWEEP_S)
            now_s = clock()
            for connection in self._connections:
                if connection.open and connection.waits.over(now_s):
                    connection.drop()
            self._report_closed(now_s)

    def _report_closed(self, now_s: float) -> None:
        if not self._closed or now_s - self._reported_s < _SENTENCE_S:
            return
        (address, _), count = self._closed.most_common(1)[0], self._closed.total()
        self._reported_s, self._closed = now_s, Counter()
        with contextlib.suppress(OSError):  # the terminal is closed
            self._report(
                f"the dashboard closed {count} connections, most of them from {address}: the limit is "
                f"{self._most}, or {self._most // 2} from one address; the run continues"
            )


def _gone(taken: socket.socket) -> bool:
    """Whether the client has closed its end, whatever it has sent before; False where the system does not tell."""
    if not hasattr(select, "POLLRDHUP"):
        return False
    poll = select.poll()
    poll.register(taken, select.POLLRDHUP)
    return bool(poll.poll(0))


def _has_sent(taken: socket.socket) -> bool:
    try:
        return taken.recv(1, socket.MSG_PEEK) != b""
    except OSError:
        return False
