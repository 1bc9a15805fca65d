"""MQTT: mosquitto, a broker that supports only MQTT 3.1.1 (nats-server), and a publisher at them."""

from __future__ import annotations

import os
import ssl
import subprocess
from pathlib import Path
from typing import Any, ClassVar

from paho.mqtt import client as mqtt

from livebode.sources.live import Batch, encode_layout, encode_samples
from tests.support.peers.peer import CHANNELS, RATE_HZ, Peer, free_port, program, until

TOPIC = "plant/axis1"


class Mosquitto:
    """The broker on a free port of the loopback, its log in a file."""

    name, runs, subscribed = "mosquitto", "running", "Sending SUBACK"
    """The program, and what it logs when it runs, and for each subscription."""

    def __init__(self, folder: Path, lines: tuple[str, ...] = ("allow_anonymous true",)) -> None:
        self._program = program(self.name)
        self.port = free_port()
        self._log = folder / f"{self.name}.log"
        self._log.touch()
        self._settings = folder / f"{self.name}.conf"
        self._settings.write_text(self.written(lines, folder))
        self._process: subprocess.Popen[bytes] | None = None

    def written(self, lines: tuple[str, ...], folder: Path) -> str:  # noqa: ARG002 - for another broker
        """The broker's settings."""
        listener = [
            f"listener {self.port} 127.0.0.1",
            *lines,
            "log_dest stderr",
            "log_type all",
            "set_tcp_nodelay true",
        ]
        if os.geteuid() == 0:  # else it becomes a user that may not read the tests' files
            listener.append("user root")
        return "\n".join(listener) + "\n"

    def __enter__(self) -> Mosquitto:
        began = self.logged(self.runs)
        with self._log.open("ab") as log:
            self._process = subprocess.Popen([self._program, "-c", str(self._settings)], stdout=log, stderr=log)
        try:
            until(lambda: self.logged(self.runs) > began or self._process.poll() is not None, "the broker to run")
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


class Nats(Mosquitto):
    """nats-server, which rejects MQTT 5."""

    name, runs, subscribed, left = "nats-server", "Server is ready", "[SUBACK", "[DELSUB"
    """Also what it logs when a client leaves."""

    def written(self, lines: tuple[str, ...], folder: Path) -> str:
        return "\n".join(
            [
                "server_name: tests",
                f'listen: "127.0.0.1:{free_port()}"',
                f'jetstream {{ store_dir: "{folder / "jetstream"}", max_file: 64MB, max_mem: 16MB }}',
                f'mqtt {{ listen: "127.0.0.1:{self.port}" }}',
                "trace: true",
                *(line for line in lines if not line.startswith("allow_")),
            ]
        )


class MqttPeer(Peer):
    broker: ClassVar[type[Mosquitto]] = Mosquitto

    def __enter__(self) -> MqttPeer:
        self._broker = self.broker(self.folder).__enter__()
        self.settings = {"url": f"mqtt://127.0.0.1:{self._broker.port}/{TOPIC}"}
        self._publisher = publisher(self._broker.port)
        self._subscribed = 0
        return self

    def __exit__(self, *_: object) -> None:
        stop(self._publisher)
        self._broker.__exit__()

    def wait_ready(self) -> None:
        until(lambda: self._broker.logged(self.broker.subscribed) > self._subscribed, "a subscription")
        self._subscribed = self._broker.logged(self.broker.subscribed)
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


class Mqtt311Peer(MqttPeer):
    broker = Nats


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
