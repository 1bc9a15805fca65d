"""`livebode run --serve` under attack by one who has no token: what the owner and the record notice of it."""

from __future__ import annotations

import contextlib
import os
import re
import resource
import selectors
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from typing import Self

from tests.support.peers.certificates import Authority
from tests.support.peers.machine import Machine
from tests.support.peers.peer import PATIENCE_S, until
from tests.support.small_axis import SMALL_AXIS

TOKEN = "owner-" + "x" * 40
_HEAD = "HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\n"
AXIS = (
    SMALL_AXIS
    + """[record]
segment_s = 1
[serve]
port = 0
"""
)


class Attacked:
    """A live run with its dashboard in a process with few descriptors; its log is a file."""

    def __init__(self, folder: Path, machine: Machine, descriptors: int, tls: bool = False) -> None:
        self.folder, self.descriptors = folder, descriptors
        text = f'source.url = "{machine.settings["url"]}"\n' + AXIS
        self._trust: ssl.SSLContext | None = None
        if tls:
            authority = Authority(folder, "authority")
            certificate, key = authority.sign("dashboard")
            text += f'certificate_file = "{certificate}"\nkey_file = "{key}"\n'
            self._trust = ssl.create_default_context(cafile=str(authority.file))
        (folder / "axis.toml").write_text(text)
        self.log = folder / "log.txt"

    def __enter__(self) -> Self:
        command = [Path(sys.executable).with_name("livebode"), "run", self.folder / "axis.toml", "--serve", "--out"]
        limit = self.descriptors, self.descriptors
        with self.log.open("wb") as log:
            self._process = subprocess.Popen(
                [*map(str, command), str(self.folder / "run")],
                stdout=subprocess.DEVNULL,
                stderr=log,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, limit),
            )
        found = until(lambda: re.search(r"dashboard is at https?://127.0.0.1:(\d+)/", self.log.read_text()), "the page")
        self.port = int(found.group(1))
        until(self.closed, "the first segment")
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait(PATIENCE_S)

    @property
    def origin(self) -> str:
        return f"{'http' if self._trust is None else 'https'}://127.0.0.1:{self.port}"

    def ask(self, path: str) -> int:
        """Status of a request; 0 where there is no answer.

        A connection that is closed before an answer is opened once more, as a browser does (RFC 9112, 9.3.1): with half
        of all connections open, one that sends its request late gives its place to another.
        """
        return self._ask_once(path) or self._ask_once(path)

    def _ask_once(self, path: str) -> int:
        if self._trust is None:
            connection = HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        else:
            connection = HTTPSConnection("127.0.0.1", self.port, timeout=PATIENCE_S, context=self._trust)
        try:
            connection.request("GET", path)
            answer = connection.getresponse()
            answer.read()
            return answer.status
        except (OSError, HTTPException):
            return 0
        finally:
            connection.close()

    def closed(self) -> str:
        """The newest segment that is closed; the manifest is written again from time to time, and is shorter then."""
        path = self.folder / "run" / "manifest.jsonl"
        lines = path.read_text().splitlines() if path.exists() else []
        return next((line for line in reversed(lines) if line.startswith('{"closed"')), "")

    def open_descriptors(self) -> int:
        return len(list(Path(f"/proc/{self._process.pid}/fd").iterdir()))

    def memory_mb(self) -> float:
        status = Path(f"/proc/{self._process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024


class Noticed:
    """What the owner and the record noticed of an attack."""

    def __init__(self) -> None:
        self.delays_s: list[float] = []
        self.statuses: dict[int, int] = {}
        self.record_s = 0.0
        self.descriptors = 0
        self.memory_mb = 0.0
        self.log_bytes = 0


def watched_during(attacked: Attacked, attack: Callable[[Attacked, threading.Event], None], seconds: float) -> Noticed:
    """Let an attack go on for so long, and ask for an ordinary page ten times a second meanwhile."""
    noticed, over = Noticed(), threading.Event()
    size = attacked.log.stat().st_size
    attacker = threading.Thread(target=attack, args=(attacked, over))
    looker = threading.Thread(target=_look_at_the_record, args=(attacked, over, noticed))
    attacker.start()
    looker.start()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        began = time.monotonic()
        status = attacked.ask("/api/moment?axis=0&from=1&to=1")
        noticed.delays_s.append(time.monotonic() - began)
        noticed.statuses[status] = noticed.statuses.get(status, 0) + 1
        time.sleep(max(0.0, 0.1 - (time.monotonic() - began)))
    over.set()
    attacker.join()
    looker.join()
    noticed.log_bytes = attacked.log.stat().st_size - size
    return noticed


def _look_at_the_record(attacked: Attacked, over: threading.Event, noticed: Noticed) -> None:
    """The longest time that no segment was closed, beyond the usual."""
    newest, since = attacked.closed(), time.monotonic()
    while not over.wait(0.02):
        now, closed = time.monotonic(), attacked.closed()
        if closed != newest:
            newest, since = closed, now
        noticed.record_s = max(noticed.record_s, now - since)
        noticed.descriptors = max(noticed.descriptors, attacked.open_descriptors())
        noticed.memory_mb = max(noticed.memory_mb, attacked.memory_mb())


def held(count: int, request: str = "", *, deaf: bool = False) -> Callable[[Attacked, threading.Event], None]:
    """So many connections that say this and then nothing, each opened again when it is closed."""

    def attack(attacked: Attacked, over: threading.Event) -> None:
        data = request.replace("{head}", _HEAD).replace("{origin}", attacked.origin)
        data = data.replace("{host}", attacked.origin.partition("//")[2]).encode()
        with selectors.DefaultSelector() as selector:
            for _ in range(count):
                _open(attacked, selector, data, deaf)
            while not over.wait(0.1):  # the attacker's work is not to be what takes the owner's time
                lost = count - len(selector.get_map())
                for key, _ in selector.select(0):
                    if deaf and not _closed(key.fileobj):
                        continue
                    _drain(selector, key.fileobj)
                for _ in range(lost):
                    _open(attacked, selector, data, deaf)
            for key in list(selector.get_map().values()):
                key.fileobj.close()

    return attack


def flood(attacked: Attacked, over: threading.Event) -> None:
    """Connections that are opened and closed as fast as one core can."""
    os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 19)
    while not over.is_set():
        with contextlib.suppress(OSError):
            socket.create_connection(("127.0.0.1", attacked.port), timeout=5).close()


def short(count: int, paths: Sequence[str], *, reset: bool = False) -> Callable[[Attacked, threading.Event], None]:
    """Floods of so many connections that send one request and close, again and again with a pause of a second."""

    def attack(attacked: Attacked, over: threading.Event) -> None:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 10)
        while not over.is_set():
            for number in range(count):
                data = f"GET {paths[number % len(paths)]} {_HEAD}\r\n".replace("{origin}", attacked.origin)
                with contextlib.suppress(OSError), socket.socket() as one:
                    if reset:
                        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                    one.settimeout(0.5)
                    one.connect(("127.0.0.1", attacked.port))
                    one.sendall(data.replace("{host}", attacked.origin.partition("//")[2]).encode())
            over.wait(1.0)

    return attack


def _open(attacked: Attacked, selector: selectors.BaseSelector, data: bytes, deaf: bool) -> None:
    one = socket.socket()
    if deaf:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    one.settimeout(1)
    try:
        one.connect(("127.0.0.1", attacked.port))
        one.sendall(data)
    except OSError:
        one.close()
        return
    one.setblocking(False)
    selector.register(one, selectors.EVENT_READ)


def _closed(one: socket.socket) -> bool:
    try:
        return one.recv(1, socket.MSG_PEEK) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


def _drain(selector: selectors.BaseSelector, one: socket.socket) -> None:
    try:
        if one.recv(1 << 16):
            return
    except BlockingIOError:
        return
    except OSError:
        pass
    selector.unregister(one)
    one.close()


def attacks(count: int) -> Iterator[tuple[str, Callable[[Attacked, threading.Event], None]]]:
    """Each kind with its name; `count` connections where it holds many."""
    body = "POST /login {head}Content-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
    yield "stalled bodies", held(130, body)
    yield "silent connections", held(count)
    yield "half heads", held(count, "GET / {head}X-Slow: 1\r\nX-")
    yield "idle after an answer", held(count, "GET /login {head}\r\n")
    yield "answers never read", held(count // 4, "GET /static/uplot/uPlot.esm.js {head}\r\n" * 8, deaf=True)
    yield "opened and closed", flood
    yield "short log-in pages", short(2 * count, ["/login"])
    yield "short files", short(2 * count, ["/catalogue", "/static/main.js", "/static/bode.js"])
    yield "short exports", short(2 * count, [f"/api/export?axis=0&from=0&to={to}" for to in range(1, 20)])
    yield "short responses", short(2 * count, [f"/api/moment?axis=0&from={at}&to={at}" for at in range(20)], reset=True)
