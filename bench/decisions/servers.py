"""How long one client waits behind a flood of short connections: servers compared with livebode's listener.

`python -m bench.decisions.servers [PYTHON]`: PYTHON is an interpreter with uvicorn, hypercorn and granian. Each server
has the same application, which computes for a millisecond. 2,000 connections send a request and close, as fast as one
core can; then one client asks.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from http.client import HTTPConnection
from pathlib import Path

CONNECTIONS, TIMES, TIMEOUT_S = 2000, 3, 60.0
_REQUEST = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
APPLICATION = """
import time
async def app(scope, receive, send):
    if scope["type"] == "http":
        until = time.thread_time() + 1e-3
        while time.thread_time() < until:
            pass
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})
"""
OURS = """
import asyncio, sys, uvicorn
from flooded import app
from livebode.dashboard.dashboard import listening
from livebode.dashboard.server import Server
from livebode.dashboard.server_settings import ServerSettings
config = uvicorn.Config(app, lifespan="off", log_config=None)
asyncio.run(Server(config, listening(ServerSettings("127.0.0.1", int(sys.argv[1]))), print).serve())
"""


def commands(other: str, port: int) -> dict[str, list[str]]:
    """The command of each server; it listens at this port."""
    at = str(port)
    return {
        "livebode's listener": [sys.executable, "-c", OURS, at],
        "uvicorn": [other, "-m", "uvicorn", "flooded:app", "--port", at, "--log-level", "critical"],
        "hypercorn": [other, "-m", "hypercorn", "flooded:app", "--bind", f"127.0.0.1:{at}"],
        "granian": [other, "-m", "granian", "flooded:app", "--interface", "asginl", "--port", at, "--no-log"],
    }


def answered_s(port: int) -> float:
    """Time until one request is answered; infinite without an answer."""
    began = time.monotonic()
    connection = HTTPConnection("127.0.0.1", port, timeout=TIMEOUT_S)
    try:
        connection.request("GET", "/")
        connection.getresponse().read()
    except OSError:
        return float("inf")
    finally:
        connection.close()
    return time.monotonic() - began


def flood(port: int) -> None:
    for _ in range(CONNECTIONS):
        with socket.socket() as one:
            one.settimeout(0.5)
            try:
                one.connect(("127.0.0.1", port))
                one.sendall(_REQUEST)
            except OSError:
                continue


def measured(command: list[str], port: int, folder: str) -> list[float]:
    """Time of one request behind each flood; empty if the server does not start."""
    silent, environment = subprocess.DEVNULL, os.environ | {"PYTHONPATH": folder}
    process = subprocess.Popen(command, cwd=folder, stdout=silent, stderr=silent, env=environment)
    try:
        until, waits = time.monotonic() + TIMEOUT_S, list[float]()
        while answered_s(port) == float("inf"):
            if process.poll() is not None or time.monotonic() > until:
                return []
            time.sleep(0.1)
        for _ in range(TIMES):
            flood(port)
            waits.append(answered_s(port))
            time.sleep(2.0)
        return waits
    finally:
        process.kill()
        process.wait()


def main() -> None:
    """Print the waits of each server."""
    other = sys.argv[1] if len(sys.argv) > 1 else sys.executable
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "flooded.py").write_text(APPLICATION)
        print(f"one request behind {CONNECTIONS} short connections, load {os.getloadavg()[0]:.1f}")
        for number, name in enumerate(commands(other, 0)):
            port = 18700 + number
            waits = measured(commands(other, port)[name], port, folder)
            print(f"{name:22}" + "".join(f"{wait:8.2f} s" for wait in waits), flush=True)


if __name__ == "__main__":
    main()
