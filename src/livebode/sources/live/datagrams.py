"""DatagramReceiver: one thread that receives the datagrams of all UDP sources of a process.

A thread of each source would be woken for each datagram, and wait each time for the interpreter, which the tracking
threads use: with 64 axes that cost a third of tracking.
"""

from __future__ import annotations

import os
import selectors
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from livebode.sources.live.arrived import ArrivedDatagrams

TICK_S = 0.1
"""Longest time until a new port is received from, where the system does not notice it at once."""


class DatagramReceiver:
    """Passes each datagram of a port, and the host that sent it, to the function that is registered for the port.

    Its thread exists as long as a port does.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()  # held while datagrams are passed on
        self._selector = selectors.DefaultSelector()
        self._thread: threading.Thread | None = None
        self._failures: dict[int, Exception] = {}
        self._arrived = ArrivedDatagrams()

    @contextmanager
    def receiving(self, port: socket.socket, take: Callable[[bytes, str], None]) -> Iterator[Callable[[], None]]:
        """Register a port in this context; yields a function that raises what its socket or `take` raised."""
        port.setblocking(False)
        number = port.fileno()
        with self._lock:
            self._selector.register(port, selectors.EVENT_READ, take)
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="livebode datagrams", daemon=True)
                self._thread.start()

        def check() -> None:
            if number in self._failures:
                raise self._failures[number]

        try:
            yield check
        finally:
            with self._lock:
                if self._failures.pop(number, None) is None:
                    self._selector.unregister(port)

    def _work(self) -> None:
        while True:
            ready = self._selector.select(TICK_S)
            with self._lock:
                for key, _ in ready:
                    # One of each port: a sender that floods its port does not keep the others waiting.
                    if key.fd in self._selector.get_map():
                        self._receive(key)
                if not self._selector.get_map():
                    self._thread = None
                    return

    def _receive(self, key: selectors.SelectorKey) -> None:
        assert isinstance(key.fileobj, socket.socket)
        try:
            key.data(*self._arrived.take(key.fileobj))
        except BlockingIOError:  # the system dropped what it had announced: its checksum was wrong
            return
        except Exception as error:  # any error: the source raises it in its own thread
            self._failures[key.fd] = error
            self._selector.unregister(key.fileobj)


_receivers = [DatagramReceiver()]
if hasattr(os, "register_at_fork"):  # the thread does not exist in a child

    def _renew() -> None:
        _receivers[0] = DatagramReceiver()

    os.register_at_fork(after_in_child=_renew)


def receiver() -> DatagramReceiver:
    """The receiver of this process."""
    return _receivers[0]
