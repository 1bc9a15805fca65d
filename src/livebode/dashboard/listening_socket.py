"""The socket of the dashboard, which `livebode doctor` tries without the dashboard."""

from __future__ import annotations

import errno
import socket

from livebode.core import ServerError
from livebode.dashboard.server_settings import ServerSettings

BACKLOG = 4096
"""Connections that the system queues until they are accepted; a client that finds no room retries a second later."""
UNREAD_BYTES = 64 << 10
"""Part of an answer that the system buffers for a client that does not read; else it takes megabytes, and the requests
behind the first one are answered too, at the expense of others."""


def listening(serving: ServerSettings) -> socket.socket:
    """A socket that listens where the dashboard is to be."""
    family = socket.AF_INET6 if ":" in serving.address else socket.AF_INET
    server = socket.socket(family, socket.SOCK_STREAM)
    try:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        server.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNREAD_BYTES)  # accepted connections inherit it
        server.bind((serving.address, serving.port))
        server.listen(BACKLOG)
        server.setblocking(False)
    except OSError as error:
        server.close()
        if error.errno == errno.EADDRINUSE:
            raise ServerError(
                "port-taken",
                f"port {serving.port} is taken",
                "choose another port, or 0 for a free one",
                argument="port",
                port=serving.port,
            ) from None
        raise ServerError(
            "cannot-listen",
            f"{serving.address} port {serving.port} cannot be listened on: {error.strerror}",
            "choose an address of this computer and a port that you may use",
            argument="port",
            address=serving.address,
            port=serving.port,
            errno=error.errno,
        ) from None
    return server
