"""Listener: accepts connections, and limits them so that the record has descriptors and the owner a connection."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
import sys
from collections import Counter
from collections.abc import Callable

from livebode.dashboard.access import network
from livebode.dashboard.patience import ClientWait, PatientProtocol

CONNECTIONS_MAX = 128
HANDSHAKE_S = 10.0
"""Limit for the first byte and the TLS handshake."""
_DESCRIPTORS_PER_CONNECTION = 4  # the connection and a file that it receives; as many are reserved for the record
_SWEEP_S = 1.0
_SENTENCE_S = 60.0
_REST_S = 0.2


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
        self.socket, self.address, self._since_s = taken, address, since_s
        self.protocol: PatientProtocol | None = None  # known after the TLS handshake
        self.serving: asyncio.Task[None] | None = None

    @property
    def open(self) -> bool:
        return self.socket.fileno() >= 0

    @property
    def waits(self) -> ClientWait:
        return ClientWait(self._since_s, HANDSHAKE_S) if self.protocol is None else self.protocol.waits

    def drop(self) -> None:
        if self.protocol is not None:
            self.protocol.transport.abort()
        elif self.serving is not None:
            self.serving.cancel()


class Listener:
    """Accepts connections and hands them to the server's protocol.

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
        self._closed: Counter[str] = Counter()
        self._reported_s = float("-inf")

    async def run(self) -> None:
        """Accept connections until it is cancelled."""
        loop = asyncio.get_running_loop()
        sweeping = loop.create_task(self._sweep())
        try:
            while True:
                try:
                    taken, address = await loop.sock_accept(self._socket)
                except OSError:  # the client has gone, or another part used up the descriptors
                    await asyncio.sleep(_REST_S)
                    continue
                self._take(taken, network(str(address[0])), loop.time())
                await asyncio.sleep(0)  # one at a time: with more, a request would be closed before it is read
        finally:
            sweeping.cancel()
            self._report_closed(float("inf"))

    def _take(self, taken: socket.socket, address: str, now_s: float) -> None:
        if not self._room(address):
            taken.close()
            return
        connection = _Connection(taken, address, now_s)
        self._connections.append(connection)
        connection.serving = asyncio.get_running_loop().create_task(self._serve(connection))

    def _room(self, address: str) -> bool:
        """Whether there is room for a connection from this address; closes another one if necessary."""
        self._connections = [connection for connection in self._connections if connection.open]
        crowd = [connection for connection in self._connections if connection.address == address]
        if len(crowd) < self._most // 2:
            crowd = self._connections
            if len(crowd) < self._most:
                return True
        waits = [connection.waits for connection in crowd]
        closable = [(one.since_s, i) for i, one in enumerate(waits) if one.limit_s is not None]
        self._closed[address] += 1
        if not closable:
            return False
        longest = crowd[min(closable)[1]]
        longest.drop()
        self._connections.remove(longest)
        return True

    async def _serve(self, connection: _Connection) -> None:
        loop, limit_s = asyncio.get_running_loop(), None if self._tls is None else HANDSHAKE_S
        try:
            # No protocol before the first byte; with TLS it takes a quarter of a megabyte.
            if not await _spoken(connection.socket):
                connection.socket.close()
                return
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


async def _spoken(taken: socket.socket) -> bool:
    """Wait for the first byte; False if the client has gone without one."""
    loop, came = asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(taken, came.set)
    try:
        await came.wait()
    finally:
        loop.remove_reader(taken)
    return taken.recv(1, socket.MSG_PEEK) != b""
