"""ArrivedDatagrams: takes what has arrived at a port, without letting another thread have the interpreter meanwhile.

`socket.recvfrom` releases the interpreter's lock for a microsecond. That wakes the threads that wait for the lock, and
is too short for any of them to get it: with thousands of datagrams per second all threads are late
(`python -m bench.hall`). A call that does not wait has no reason to release it.
"""

from __future__ import annotations

import ctypes
import socket
import sys
from functools import lru_cache
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

    def take(self, port: socket.socket) -> tuple[bytes, str]:
        """The next datagram of a port that does not block, and the host that sent it.

        Raises BlockingIOError if there is none, and OSError if the port failed.
        """
        if sys.platform != "linux" or port.family != socket.AF_INET:
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
