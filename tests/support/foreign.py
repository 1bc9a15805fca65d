"""A program that is not written for livebode and sends its own JSON: by UDP, TCP or MQTT."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from collections.abc import Callable, Iterator

import numpy as np

from tests.support.command import signals
from tools import sending as steadily

SAMPLES = 10
PERIOD_S = SAMPLES / 1000.0
FIELDS = {"torque_inject": "drive.torque.inject", "torque_actual": "drive.torque.actual", "vel": "axes[0].vel"}


def messages(start: int = 0) -> Iterator[bytes]:
    """Ten samples of the machine of `signals` in each message."""
    rows = {name: np.resize(row[: len(row) // 20 * 20], 100_000) for name, row in signals().items()}
    for first in range(start, 100_000, SAMPLES):
        w, u, y = (rows[name][first : first + SAMPLES].tolist() for name in "wuy")
        yield json.dumps({
            "device": "X20", "ts": 1.8e9 + first / 1000, "n": first,
            "drive": {"torque": {"inject": w, "actual": u}, "enabled": True}, "axes": [{"vel": y}],
        }).encode()  # fmt: skip


def sending(send: Callable[[bytes], object], payloads: Iterator[bytes]) -> contextlib.AbstractContextManager[None]:
    """Send a message every ten milliseconds."""

    def next_one(_: int) -> None:
        if (payload := next(payloads, None)) is not None:
            with contextlib.suppress(OSError):
                send(payload)

    return steadily.sending(next_one, PERIOD_S)


@contextlib.contextmanager
def udp_sender(port: int, payloads: Iterator[bytes]) -> Iterator[None]:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link,
        sending(lambda payload: link.sendto(payload, ("127.0.0.1", port)), payloads),
    ):
        yield


@contextlib.contextmanager
def tcp_sender(payloads: Iterator[bytes]) -> Iterator[int]:
    """A server that sends each message as a line to whoever is connected; its port."""
    links: list[socket.socket] = []

    def accept() -> None:
        with contextlib.suppress(OSError):
            while True:
                links.append(server.accept()[0])

    def send(payload: bytes) -> None:
        for link in list(links):
            try:
                link.sendall(payload + b"\n")
            except OSError:
                links.remove(link)
                link.close()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=accept, daemon=True).start()
        with sending(send, payloads):
            yield server.getsockname()[1]
        for link in links:
            link.close()
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)
