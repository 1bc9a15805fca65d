"""MQTT: mosquitto, and a publisher at it."""

from __future__ import annotations

import os
import ssl
import subprocess
from pathlib import Path
from typing import Any

from paho.mqtt import client as mqtt

from livebode.sources.live import Batch, encode_layout, encode_samples
from tests.support.peers.peer import CHANNELS, RATE_HZ, Peer, free_port, program, until

TOPIC = "plant/axis1"


class Mosquitto:
    """The broker on a free port of the loopback, its log in a file."""

    def __init__(self, folder: Path, lines: tuple[str, ...] = ("allow_anonymous true",)) -> None:
        self._program = program("mosquitto")
        self.port = free_port()
        self._log = folder / "mosquitto.log"
        self._log.touch()
        self._settings = folder / "mosquitto.conf"
        listener = [
            f"listener {self.port} 127.0.0.1",
            *lines,
            "log_dest stderr",
            "log_type all",
            "set_tcp_nodelay true",
        ]
        if os.geteuid() == 0:  # else it becomes a user that may not read the tests' files
            listener.append("user root")
        self._settings.write_text("\n".join(listener) + "\n")
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Mosquitto:
        began = self.logged("running")
        with self._log.open("ab") as log:
            self._process = subprocess.Popen([self._program, "-c", str(self._settings)], stdout=log, stderr=log)
        try:
            until(lambda: self.logged("running") > began or self._process.poll() is not None, "the broker to run")
            assert self._process.poll() is None, self._log.read_text()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process is not None
        self._process.kill()
        self._process.wait()

    def logged(self, text: str) -> int:
        """How often the broker wrote this into its log."""
        return self._log.read_text(errors="replace").count(text)


class MqttPeer(Peer):
    def __enter__(self) -> MqttPeer:
        self._broker = Mosquitto(self.folder).__enter__()
        self.settings = {"url": f"mqtt://127.0.0.1:{self._broker.port}/{TOPIC}"}
        self._publisher = publisher(self._broker.port)
        self._subscribed = 0
        return self

    def __exit__(self, *_: object) -> None:
        stop(self._publisher)
        self._broker.__exit__()

    def wait_ready(self) -> None:
        until(lambda: self._broker.logged("Sending SUBACK") > self._subscribed, "a subscription")
        self._subscribed = self._broker.logged("Sending SUBACK")
        self._publish(encode_layout(CHANNELS, RATE_HZ))

    def _publish(self, payload: bytes) -> None:
        self._publisher.publish(TOPIC, payload, qos=1).wait_for_publish(10)

    def send(self, batch: Batch) -> None:
        self._publish(encode_samples(batch, double=True))

    def send_rubbish(self) -> None:
        self._publish(b"23.5")

    def interrupt(self) -> None:
        stop(self._publisher)
        self._broker.__exit__()
        self._broker.__enter__()
        self._publisher = publisher(self._broker.port)
        self.wait_ready()


def publisher(port: int, context: ssl.SSLContext | None = None, login: tuple[str, str] | None = None) -> Any:
    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
    if context is not None:
        client.tls_set_context(context)
    if login is not None:
        client.username_pw_set(*login)
    client.connect("127.0.0.1", port)
    client.loop_start()
    until(client.is_connected, "the publisher to connect")
    return client


def stop(client: Any) -> None:
    client.disconnect()
    client.loop_stop()
