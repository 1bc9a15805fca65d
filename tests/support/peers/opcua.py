"""OPC UA: the asyncua server in another process, forked from one that has imported it."""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from functools import cache
from itertools import count
from pathlib import Path

from livebode.sources.live import Batch
from tests.support.peers.peer import CHANNELS, RATE_HZ, STAMP_S, Peer, free_port

SERVER = Path(__file__).with_name("opcua_server.py")


@cache
def _forking() -> socket.socket:
    """Orders to the process that forks servers; it ends when they do."""
    own, orders = socket.socketpair()
    process = subprocess.Popen([sys.executable, str(SERVER), str(orders.fileno())], pass_fds=[orders.fileno()])
    orders.close()

    def end() -> None:
        own.close()
        process.wait()

    atexit.register(end)
    return own


class OpcUaPeer(Peer):
    def __init__(self, folder: Path, certificates: Path | None = None, login: tuple[str, ...] = ()) -> None:
        super().__init__(folder)
        self._arguments = [str(certificates or ""), login]

    def __enter__(self) -> OpcUaPeer:
        self._port = free_port()
        self._stamps = count(STAMP_S / 2)
        self.settings = {
            "url": f"opc.tcp://127.0.0.1:{self._port}/livebode",
            "rate_hz": RATE_HZ,
            "nodes": {f"{c.name} [{c.unit}]": f"ns=2;s=axis.{c.name}" for c in CHANNELS},
            "sample_node": "ns=2;s=axis.sample",
        }
        self._start()
        return self

    def _start(self) -> None:
        (told, tell), (listen, said) = os.pipe(), os.pipe()
        socket.send_fds(_forking(), [json.dumps([self._port, *self._arguments]).encode()], [told, said])
        os.close(told)
        os.close(said)
        self._to, self._from = os.fdopen(tell, "w"), os.fdopen(listen)
        word, number = self._from.readline().split()
        assert word == "serving"
        self._process = int(number)

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)
        self._from.read()  # until it has ended
        self._from.close()
        with contextlib.suppress(BrokenPipeError):
            self._to.close()

    def wait_ready(self) -> None:
        assert self._from.readline() == "ready\n"

    def _write(self, fields: dict) -> None:
        self._to.write(json.dumps(fields) + "\n")
        self._to.flush()

    def send(self, batch: Batch) -> None:
        self._write({"sample": batch.first_sample, "data": batch.data.tolist(), "stamp_s": batch.stamp_s})

    def send_rubbish(self) -> None:
        self._write({"sample": 0, "data": [[1.0, 2.0, 3.0], [1.0]], "stamp_s": next(self._stamps)})

    def interrupt(self) -> None:
        self.__exit__()
        self._start()
        self.wait_ready()
