"""What a person may find at a port: nothing, garbage, or the JSON of a program that knows nothing of livebode."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from bench.first_hour.servo import SERVO, recorded
from tools.sending import sending

GARBAGE = b"temp=21.4;rpm=1500\r\n"
SAMPLES = 40  # of a message
CONFIGURATION = """[source]
url = "udp://127.0.0.1:{port}"
[signals]
excitation = "w"
input = "u"
output = "y"
[lines]
frequencies = "20:140:20"
window = 400
"""


def free_port() -> int:
    """A port of this computer that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def garbage(port: int) -> Iterator[None]:
    """Datagrams of another program, 50 per second."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        sending(lambda _: sender.sendto(GARBAGE, ("127.0.0.1", port)), 0.02),
    ):
        yield


@contextmanager
def foreign_json(folder: Path) -> Iterator[str]:
    """A broker, and the servo that publishes JSON with its own names there, in real time; the URL of its topic."""
    from paho.mqtt import client as mqtt

    program = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin")
    assert program, "mosquitto is not installed: make system-packages"
    port, settings = free_port(), folder / "mosquitto.conf"
    settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\n")
    recording = recorded()
    rows = {name: recording[name] for name in ("excitation", "torque", "speed")}
    count = rows["torque"].size

    def message(number: int) -> bytes:
        index = np.arange(number * SAMPLES, (number + 1) * SAMPLES) % count
        w, u, y = (row[index].tolist() for row in rows.values())
        drive = {"torque": {"inject": w, "actual": u}, "speed": y}
        return json.dumps({"device": "X20", "n": number * SAMPLES, "drive": drive}).encode()

    with subprocess.Popen([program, "-c", settings], stderr=subprocess.DEVNULL) as broker:
        link = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        try:
            _connected(link, port)
            link.loop_start()
            with sending(lambda number: link.publish("hall/press3", message(number)), SAMPLES / SERVO.rate_hz):
                yield f"mqtt://127.0.0.1:{port}/hall/press3"
        finally:
            link.disconnect()
            link.loop_stop()
            broker.terminate()


def _connected(link: object, port: int) -> None:
    """Connect, once the broker listens."""
    end = time.monotonic() + 10
    while True:
        try:
            link.connect("127.0.0.1", port)  # type: ignore[attr-defined]
        except OSError:
            assert time.monotonic() < end, "the broker does not listen"
            time.sleep(0.05)
        else:
            return
