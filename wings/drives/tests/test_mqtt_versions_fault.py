"""A broker that supports only one version of MQTT, whatever it does with the other, is subscribed to by that one."""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from livebode.core import SourceError
from livebode.sources.live import SourceSettings, encode_layout, encode_samples, make_source, open_source
from tests.support.peers.broker import TOPIC, Mosquitto, Nats, publisher, stop
from tests.support.peers.peer import CHANNELS, PATIENCE_S, RATE_HZ, batches, free_port, taken, until

V311, V5 = 4, 5
REJECTED = b"\x20\x02\x00\x01"
"""A broker's answer of MQTT 3.1.1: unacceptable protocol version."""


@contextlib.contextmanager
def gate(broker: int | None, answer: Callable[[int], bytes | None]) -> Iterator[tuple[int, list[int]]]:
    """A port that passes a client on to the broker, or sends it an answer by its version and closes; and the versions.

    `answer` gives None for a version that is passed on.
    """
    seen: list[int] = []
    links: list[socket.socket] = []

    def pump(source: socket.socket, to: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                to.sendall(data)
            to.shutdown(socket.SHUT_WR)

    def serve() -> None:
        with contextlib.suppress(OSError):
            while True:
                link, _ = server.accept()
                links.append(link)
                first = link.recv(1 << 16)
                seen.append(first[first.index(b"MQTT") + 4])
                if (said := answer(seen[-1])) is not None:
                    link.sendall(said)
                    link.close()
                    continue
                onward = socket.create_connection(("127.0.0.1", broker))
                links.append(onward)
                onward.sendall(first)
                for pair in ((link, onward), (onward, link)):
                    threading.Thread(target=pump, args=pair, daemon=True).start()

    with socket.create_server(("127.0.0.1", free_port())) as server:
        threading.Thread(target=serve, daemon=True).start()
        try:
            yield server.getsockname()[1], seen
        finally:
            for link in links:
                link.close()
            server.shutdown(socket.SHUT_RDWR)


def settings(port: int, **more: object) -> SourceSettings:
    return SourceSettings(url=f"mqtt://127.0.0.1:{port}/{TOPIC}", timeout_s=PATIENCE_S, **more)


@pytest.mark.parametrize(("only", "said"), [(V311, REJECTED), (V311, b""), (V5, b"")])
def test_the_version_of_the_broker_is_found(tmp_path: Path, only: int, said: bytes) -> None:
    """Whether it says why it closes the connection, or only closes it."""
    with Mosquitto(tmp_path) as broker, gate(broker.port, lambda v: None if v == only else said) as (port, seen):
        client = publisher(broker.port)
        client.publish(TOPIC, encode_layout(CHANNELS, RATE_HZ), qos=1, retain=True).wait_for_publish(PATIENCE_S)
        source = make_source(settings(port))
        sender = threading.Timer(0.0, send_until, (client, done := threading.Event()))
        sender.start()
        try:
            with source.open():
                np.testing.assert_array_equal(np.diff(next(source.blocks())["w"]), 1.0)
        finally:
            done.set()
            sender.join()
            stop(client)
        assert seen[-1] == only


def send_until(client: object, done: threading.Event) -> None:
    """Publish consecutive batches until it is set: the subscription comes at some time."""
    for batch in batches(5000):
        client.publish(TOPIC, encode_samples(batch, double=True), qos=1)  # type: ignore[attr-defined]
        if done.wait(0.01):
            return


def test_a_broker_that_rejects_both_versions_is_reported_once() -> None:
    with gate(None, lambda _: REJECTED) as (port, seen):
        with pytest.raises(SourceError, match="supports neither MQTT 5 nor MQTT 3") as found:
            open_source(settings(port))
        assert found.value.code == "source.refused"
    assert seen == [V5, V311]


def test_a_broker_of_version_3_1_1_stores_messages_for_a_client_with_a_name(tmp_path: Path, caplog) -> None:
    given = batches(40)
    caplog.set_level(logging.INFO, "livebode")
    with Nats(tmp_path) as broker:
        client = publisher(broker.port)

        def send(part: slice) -> None:
            for batch in given[part]:
                client.publish(TOPIC, encode_samples(batch, double=True), qos=1).wait_for_publish(PATIENCE_S)

        def first() -> None:
            while not broker.logged(broker.subscribed):
                done.wait(0.01)
            client.publish(TOPIC, encode_layout(CHANNELS, RATE_HZ), qos=1).wait_for_publish(PATIENCE_S)
            send(slice(0, 10))

        done = threading.Event()
        thread = threading.Thread(target=first)
        thread.start()
        with open_source(settings(broker.port, client_id="livebode", reorder_batches=0)) as source:
            seen = taken(source.blocks(), 10)
            thread.join()
        # What the broker delivers to a client that is leaving is repeated after half a minute.
        until(lambda: broker.logged(broker.left), "the client to leave")
        client.publish(TOPIC, encode_layout(CHANNELS, RATE_HZ), qos=1).wait_for_publish(PATIENCE_S)
        send(slice(10, 40))
        with open_source(settings(broker.port, client_id="livebode", reorder_batches=0)) as source:
            later = taken(source.blocks(), 30)
        stop(client)
    found = np.concatenate([block.data for block in [*seen, *later]], axis=1)
    np.testing.assert_array_equal(found, np.concatenate([batch.data for batch in given], axis=1))
    assert sum("does not support MQTT 5; using MQTT 3.1.1" in message for message in caplog.messages) == 2
