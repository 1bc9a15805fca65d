"""OPC UA: the asyncua server in another process."""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import count
from pathlib import Path

from livebode.sources.live import Batch
from tests.support.peers.peer import CHANNELS, RATE_HZ, STAMP_S, Peer, free_port

SERVER = Path(__file__).with_name("opcua_server.py")


class OpcUaPeer(Peer):
    def __init__(self, folder: Path, certificates: Path | None = None, login: tuple[str, ...] = ()) -> None:
        super().__init__(folder)
        self._arguments = [str(certificates or ""), *login]

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
        self._process = subprocess.Popen(
            [sys.executable, str(SERVER), str(self._port), *self._arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._expect("serving")

    def _expect(self, word: str) -> None:
        assert self._process.stdout is not None
        fields = self._process.stdout.readline().strip()
        if fields != word:
            self.__exit__()
        assert fields == word

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()

    def wait_ready(self) -> None:
        self._expect("ready")

    def _write(self, fields: dict) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(fields) + "\n")
        self._process.stdin.flush()

    def send(self, batch: Batch) -> None:
        self._write({"sample": batch.first_sample, "data": batch.data.tolist(), "stamp_s": batch.stamp_s})

    def send_rubbish(self) -> None:
        self._write({"sample": 0, "data": [[1.0, 2.0, 3.0], [1.0]], "stamp_s": next(self._stamps)})

    def interrupt(self) -> None:
        self.__exit__()
        self._start()
        self.wait_ready()
