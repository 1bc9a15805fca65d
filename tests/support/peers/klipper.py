"""A printer with Klipper's API socket, after docs/API_Server.md of Klipper: what it answers, and when it sends what.

Its toolhead is moved to and fro by moves with constant acceleration; the accelerometer, whose clock is its own,
measures the toolhead behind a belt: the exact response to the moves, which repeat.
"""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from pathlib import Path
from typing import Any

import numpy as np

END = b"\x03"
PERIOD_S, PIECES = 0.5, 100
MOVE_S = PERIOD_S / PIECES
BATCH = 322
"""Samples of a message: a tenth of a second."""
RESONANCE_HZ, DAMPING = 60.0, 0.05
HARMONICS = 700

_signs = np.random.default_rng(1).permutation(np.repeat([-1.0, 1.0], PIECES // 2))
COMMAND = 5000.0 * _signs
"""Acceleration of each move in mm/s², without a mean: the velocity repeats as well."""


def response(f_hz: np.ndarray) -> np.ndarray:
    """Measured over commanded acceleration."""
    s = 1j * f_hz / RESONANCE_HZ
    return (1 + 2 * DAMPING * s) / (1 + 2 * DAMPING * s + s**2)


def measured(time_s: np.ndarray) -> np.ndarray:
    """What the accelerometer measures in x at these print times, after the machine has settled."""
    k = np.arange(1, HARMONICS + 1)
    turn = np.exp(-2j * np.pi * np.outer(k, np.arange(PIECES)) / PIECES)
    series = (turn @ COMMAND) * (1 - np.exp(-2j * np.pi * k / PIECES)) / (2j * np.pi * k)
    series *= response(k / PERIOD_S)
    return 2 * np.real(np.exp(2j * np.pi * np.outer(time_s, k) / PERIOD_S) @ series)


class Printer:
    """Answers one client after the other. `time_s` is its print time, which only sending advances.

    With `numbered_hz` the acceleration in y, in m/s², is the print time times this rate.
    """

    def __init__(self, folder: Path, rate_hz: float = 3213.7, numbered_hz: float = 0.0) -> None:
        self.path = folder / "klippy_uds"
        self.rate_hz, self.time_s, self.overflows = rate_hz, 100.0, 0
        self._moved_s, self._numbered_hz = self.time_s, numbered_hz
        self._templates: dict[str, Any] = {}
        self.answers: dict[str, Any] = {}
        """What is answered in place of the header, by the method."""
        self.settings = {"url": f"klipper:{self.path}"}

    def __enter__(self) -> Printer:
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(self.path))
        self._server.listen()
        self._ready, self._links = threading.Event(), []
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        self._thread.join()
        for link in self._links:
            link.close()

    def hang_up(self) -> None:
        """End the connection, as when Klipper is restarted."""
        if self._ready.is_set():
            self._ready.clear()
            self._link.close()

    def wait_ready(self) -> None:
        assert self._ready.wait(30)

    def _serve(self) -> None:
        while True:
            try:
                link, _ = self._server.accept()
            except OSError:
                return
            self._links.append(link)
            requests = b""
            with contextlib.suppress(OSError):
                while requests.count(END) < 2:
                    requests += link.recv(4096)
                self._templates = {}
                for request in requests.split(END)[:2]:
                    self._answer(link, json.loads(request))
                self._link = link
                self._ready.set()

    def _answer(self, link: socket.socket, request: dict[str, Any]) -> None:
        method, params = request["method"], request["params"]
        assert (method, params.get("sensor"), params.get("name")) in (
            ("adxl345/dump_adxl345", "adxl345", None),
            ("motion_report/dump_trapq", None, "toolhead"),
        )
        self._templates[method.partition("/")[0]] = params["response_template"]
        header = (
            ["time", "x_acceleration", "y_acceleration", "z_acceleration"]
            if method.startswith("adxl345")
            else ["time", "duration", "start_velocity", "acceleration", "start_position", "direction"]
        )
        answer = self.answers.get(method, {"result": {"header": header}})
        link.sendall(json.dumps({"id": request["id"], **answer}).encode() + END)

    def send(self, of: str, params: Any) -> None:
        self.write(json.dumps({**self._templates[of], "params": params}).encode() + END)

    def write(self, data: bytes) -> None:
        with contextlib.suppress(OSError):  # who listened has ended
            self._link.sendall(data)

    def measure(self) -> None:
        """A batch of the accelerometer; print times are estimated, and a batch is off by up to a microsecond."""
        time_s = self.time_s + np.arange(BATCH) / self.rate_hz
        self.time_s += BATCH / self.rate_hz
        y = 1e3 * self._numbered_hz * time_s - 3.0  # in mm/s²
        rows = np.stack([time_s, measured(time_s), y, np.full(BATCH, 9810.0)], axis=1)
        rows[:, 0] += 1e-6 * np.sin(self.time_s * 1e3)
        self.send("adxl345", {"data": np.round(rows, 6).tolist(), "overflows": self.overflows})

    def move(self) -> None:
        """The moves that have ended, as they are sent every half second: after the samples of their time."""
        moves = []
        while self._moved_s + MOVE_S <= self.time_s:
            piece = round(self._moved_s / MOVE_S) % PIECES
            speed = MOVE_S * COMMAND[:piece].sum() + 2000.0
            moves.append([self._moved_s, MOVE_S, speed, COMMAND[piece], [0.0] * 3, [1.0, 0.0, 0.0]])
            self._moved_s = round((self._moved_s + MOVE_S) / MOVE_S) * MOVE_S
        self.send("motion_report", {"data": moves})

    def run(self, batches: int) -> None:
        for number in range(batches):
            self.measure()
            if number % 5 == 4:
                self.move()
