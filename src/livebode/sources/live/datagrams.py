"""Datagrams of all UDP sources of a process, received by one thread, with their times of arrival."""

from __future__ import annotations

import ctypes
import os
import selectors
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from math import inf
from os import strerror

BYTES_MAX = 65535
_ADDRESS_BYTES = 128  # sockaddr_storage
_HOST = slice(4, 8)  # in sockaddr_in

if sys.platform == "linux":
    _recvfrom = ctypes.PyDLL(None, use_errno=True).recvfrom
    _recvfrom.argtypes = (
        *(ctypes.c_int, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int),
        *(ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint)),
    )
    _recvfrom.restype = ctypes.c_ssize_t


class ArrivedDatagrams:
    """Takes datagrams one by one, for one thread."""

    def __init__(self) -> None:
        self._room = ctypes.create_string_buffer(BYTES_MAX)
        self._address = ctypes.create_string_buffer(_ADDRESS_BYTES)

    def take(self, port: socket.socket, *, ipv4: bool) -> tuple[bytes, str]:
        """The next datagram of a port that does not block, and the host that sent it.

        Raises BlockingIOError if there is none, and OSError if the port failed.
        """
        if sys.platform != "linux" or not ipv4:
            datagram, (host, *_) = port.recvfrom(BYTES_MAX)
            return datagram, host
        size = ctypes.c_uint(_ADDRESS_BYTES)
        number = _recvfrom(port.fileno(), self._room, BYTES_MAX, 0, self._address, size)
        if number < 0:
            error = ctypes.get_errno()
            raise OSError(error, strerror(error))  # with EAGAIN it is a BlockingIOError
        return ctypes.string_at(self._room, number), _host(self._address.raw[_HOST])


@lru_cache(1024)
def _host(address: bytes) -> str:
    return socket.inet_ntop(socket.AF_INET, address)


TICK_S = 0.1
"""Longest time until a new port is received from, where the system does not notice it at once."""
PATIENCE_S = 0.02
"""A thread that receives may compute for so long before another one receives: the system's buffers hold more."""


class DatagramReceiver:
    """Passes each datagram of a port, and the host that sent it, to the function that is registered for the port.

    A thread that waits calls `receive`. Where none has done that for `PATIENCE_S`, a thread of its own receives, which
    exists as long as a port does.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()  # held while datagrams are passed on
        self._selector = selectors.DefaultSelector()
        self._thread: threading.Thread | None = None
        self._failures: dict[int, Exception] = {}
        self._ports: dict[int, bool] = {}  # whether they are of IPv4
        self._arrived = ArrivedDatagrams()
        self._received_until_s = -inf  # another thread receives until then
        self._bell: tuple[int, int] | None = None  # a pipe that `wake` writes to

    @contextmanager
    def receiving(self, port: socket.socket, take: Callable[[bytes, str], None]) -> Iterator[Callable[[], None]]:
        """Register a port in this context; yields a function that raises what its socket or `take` raised."""
        port.setblocking(False)
        number = port.fileno()
        with self._lock:
            self._selector.register(port, selectors.EVENT_READ, take)
            self._ports[number] = port.family == socket.AF_INET
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
                del self._ports[number]
                if self._failures.pop(number, None) is None:
                    self._selector.unregister(port)

    def receive(self, timeout_s: float) -> None:
        """Pass on what has arrived, or what arrives first within this time, and return; at once after `wake`."""
        if self._bell is None:
            self._hang_bell()
        self._received_until_s = inf
        self._pass_on(timeout_s)
        self._received_until_s = time.monotonic() + PATIENCE_S

    def wake(self) -> None:
        """Let the thread that waits in `receive` return. Any thread may call it."""
        if self._bell is not None:
            with suppress(BlockingIOError):  # it was called often enough
                os.write(self._bell[1], b"\0")

    def _hang_bell(self) -> None:
        with self._lock:
            if self._bell is None:
                self._bell = os.pipe()
                for end in self._bell:
                    os.set_blocking(end, False)
                self._selector.register(self._bell[0], selectors.EVENT_READ)

    def _work(self) -> None:
        while True:
            rest_s = self._received_until_s - time.monotonic()
            if rest_s > 0:
                time.sleep(min(rest_s, PATIENCE_S))
            else:
                self._pass_on(TICK_S)
            with self._lock:
                if len(self._selector.get_map()) == (self._bell is not None):
                    self._thread = None
                    return

    def _pass_on(self, timeout_s: float) -> None:
        ready = self._selector.select(timeout_s)
        if not ready:
            return
        with self._lock:
            for key, _ in ready:
                if key.data is None:
                    self._hear(key.fd)
                # One of each port: a sender that floods its port does not keep the others waiting.
                elif key.fd in self._ports and key.fd not in self._failures:
                    self._receive(key)

    def _hear(self, bell: int) -> None:
        """Silence the bell, unless it rings for another thread, which waits in `receive`."""
        if threading.current_thread() is not self._thread or self._received_until_s < inf:
            with suppress(BlockingIOError):
                os.read(bell, 1 << 10)

    def _receive(self, key: selectors.SelectorKey) -> None:
        assert isinstance(key.fileobj, socket.socket)
        try:
            key.data(*self._arrived.take(key.fileobj, ipv4=self._ports[key.fd]))
        except BlockingIOError:  # the system dropped what it had announced, or another thread was faster
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
