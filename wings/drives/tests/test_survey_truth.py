"""`livebode inspect` of a broker and of an OPC UA server of somebody else: topics, variables, and the proposal."""

from __future__ import annotations

import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from livebode.sources.live import Batch, SourceSettings, open_source, survey
from tests.support.command import livebode, signals
from tests.support.foreign import FIELDS, messages, sending
from tests.support.peers.broker import Mosquitto, publisher, stop
from tests.support.peers.opcua import OpcUaPeer
from tests.support.peers.peer import CHANNELS, RATE_HZ


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Mosquitto]:
    with Mosquitto(tmp_path) as running:
        yield running


def test_a_brokers_only_topic_is_found_and_its_fields_are_proposed(broker: Mosquitto, tmp_path: Path) -> None:
    client, out = publisher(broker.port), tmp_path / "axis.toml"
    with sending(lambda payload: client.publish("hall/press 3/axis1", payload), messages()):
        result = livebode("inspect", f"mqtt://127.0.0.1:{broker.port}", "--out", out, "--yes", "--rate", 1000)
        assert result.code == 0, result.err
        table = tomllib.loads(out.read_text())
        assert table["source"]["url"] == f"mqtt://127.0.0.1:{broker.port}/hall/press 3/axis1"
        assert (table["source"]["fields"], table["source"]["sample_field"]) == (FIELDS, "n")
        assert table["signals"] == {"excitation": "torque_inject", "input": "torque_actual", "output": "vel"}
        with open_source(SourceSettings(**table["source"])) as source:
            block = next(block for block in source.blocks() if len(block))
        first = source.first_sample
    stop(client)
    assert np.array_equal(block["vel"], np.resize(signals()["y"], 100_000)[first : first + len(block)])


def test_of_several_topics_each_is_listed_with_its_fields(broker: Mosquitto) -> None:
    client = publisher(broker.port)

    def send(payload: bytes) -> None:
        client.publish("hall/axis1", payload)
        client.publish("hall/temperature", b'{"celsius": 21.5}')

    with sending(send, messages()):
        found = survey(f"mqtt://127.0.0.1:{broker.port}/hall/+", 1.0)
    stop(client)
    names = {channel.name: channel.example for channel in found.channels}
    assert names["hall/temperature: celsius"] == 21.5
    assert {f"hall/axis1: {path}" for path in FIELDS.values()} <= names.keys()
    assert f"give one of them, such as mqtt://127.0.0.1:{broker.port}/hall/" in found.trouble


def test_a_broker_that_is_not_there_and_one_without_messages_are_one_sentence_each(broker: Mosquitto) -> None:
    silent = livebode("inspect", f"mqtt://127.0.0.1:{broker.port}")
    assert "no message arrived on any topic within 3 s" in silent.err
    absent = livebode("inspect", "mqtt://127.0.0.1:1")
    assert "the broker rejected the connection: Connection refused" in absent.err
    assert [result.err.count("\n") for result in (silent, absent)] == [1, 1]


def test_the_variables_of_a_server_are_browsed_and_its_numbering_node_is_recognised(tmp_path: Path) -> None:
    number, samples = 1000, 50
    rng = np.random.default_rng(4)
    with OpcUaPeer(tmp_path) as peer:
        ended = threading.Event()

        def send() -> None:
            first = number
            while not ended.wait(samples / RATE_HZ):
                data = rng.standard_normal((len(CHANNELS), samples))
                peer.send(Batch(first, data, CHANNELS, RATE_HZ, 0, 1.8e9 + first / RATE_HZ))
                first += samples

        thread = threading.Thread(target=send)
        thread.start()
        try:
            found = survey(peer.settings["url"], 2.0)
        finally:
            ended.set()
            thread.join()
    assert {channel.name for channel in found.channels} == {"ns=2;s=axis.w", "ns=2;s=axis.y", "ns=2;s=axis.sample"}
    assert found.source == {
        "url": peer.settings["url"], "rate_hz": RATE_HZ,
        "nodes": {"w": "ns=2;s=axis.w", "y": "ns=2;s=axis.y"}, "sample_node": "ns=2;s=axis.sample",
    }  # fmt: skip
