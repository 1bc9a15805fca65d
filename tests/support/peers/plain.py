"""Senders over UDP, TCP and standard input."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
from pathlib import Path

from livebode.sources.live import Batch, encode_layout, encode_line, encode_samples
from tests.support.peers.peer import CHANNELS, RATE_HZ, Peer, free_port, until


def wait_read(url: str) -> None:
    """Until what was sent to or from the port of this URL has been read by the process at the other end."""
    port = f":{int(url.rpartition(':')[2]):04X}"
    until(lambda: not _unread_bytes(port), f"everything to be read: {url}")


def _unread_bytes(port: str) -> int:
    """Bytes that wait in queues of the kernel to be sent from this port or received from it, as proc(5) has them."""
    found = 0
    for kind in ("tcp", "udp"):
        for line in Path(f"/proc/net/{kind}").read_text().splitlines()[1:]:
            _, own, other, _, queues, *_ = line.split()
            if own.endswith(port) or other.endswith(port):
                found += sum(int(queue, 16) for queue in queues.split(":"))
    return found


class UdpPeer(Peer):
    reconnects = False

    def __enter__(self) -> UdpPeer:
        port = free_port(socket.SOCK_DGRAM)
        self.settings = {"url": f"udp://127.0.0.1:{port}"}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def wait_ready(self) -> None:
        until(lambda: self._listens() and self._listens(), "the port to be open")

    def _listens(self) -> bool:
        try:
            self._socket.send(encode_layout(CHANNELS, RATE_HZ))
        except ConnectionRefusedError:
            return False
        return True

    def send(self, batch: Batch) -> None:
        with contextlib.suppress(ConnectionRefusedError):  # who listened has ended: then a datagram is lost
            self._socket.send(encode_samples(batch, double=True))

    def send_rubbish(self) -> None:
        self._socket.send(b"GET / HTTP/1.1\r\n\r\n" * 10)


class TcpPeer(Peer):
    layout = encode_layout(CHANNELS, RATE_HZ)
    port = 0

    def __enter__(self) -> TcpPeer:
        self._server = socket.create_server(("127.0.0.1", self.port))
        self.settings = {"url": f"tcp://127.0.0.1:{self._server.getsockname()[1]}"}
        self._link: socket.socket | None = None
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()
        return self

    def _accept(self) -> None:
        while True:
            try:
                link, _ = self._server.accept()
            except OSError:
                return
            link.sendall(self.layout)
            before, self._link = self._link, link
            if before is not None:
                before.close()

    def __exit__(self, *_: object) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        self._thread.join()
        if self._link:
            self._link.close()

    def wait_ready(self) -> None:
        until(lambda: self._link, "a connection")

    def send(self, batch: Batch) -> None:
        assert self._link is not None
        self._link.sendall(encode_samples(batch, double=True))

    def send_rubbish(self) -> None:
        assert self._link is not None
        self._link.sendall(b"\0" * 100)

    def hang_up(self) -> None:
        """Close the connection to a receiver that has ended."""
        assert self._link is not None
        self._link.close()
        self._link = None

    def interrupt(self) -> None:
        assert self._link is not None
        old, self._link = self._link, None
        old.close()
        self.wait_ready()


class StdinPeer(Peer):
    reconnects = False

    def __enter__(self) -> StdinPeer:
        self.settings = {"url": "stdin:"}
        reader, self._writer = os.pipe()
        self._kept, sys.stdin = sys.stdin, os.fdopen(reader)
        return self

    def __exit__(self, *_: object) -> None:
        self.end()
        sys.stdin.close()
        sys.stdin = self._kept

    def send(self, batch: Batch) -> None:
        os.write(self._writer, encode_line(batch))

    def send_rubbish(self) -> None:
        os.write(self._writer, b"this is no JSON\n")

    def end(self) -> None:
        if self._writer >= 0:
            os.close(self._writer)
            self._writer = -1
