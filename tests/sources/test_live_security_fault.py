"""Wrong certificates and passwords are refused, said once, not tried again; no secret is ever repeated."""

from __future__ import annotations

import json
import re
import socket
import ssl
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from pyads.testserver import PLCVariable

from livebode.configuration import Axis
from livebode.core import ConfigError, SourceError
from livebode.sources.live import SourceSettings, encode_layout, encode_samples, make_source, open_source
from tests.support.errors import refused
from tests.support.peers.broker import TOPIC, Mosquitto, publisher, stop
from tests.support.peers.certificates import Authority, self_signed
from tests.support.peers.opcua import OpcUaPeer
from tests.support.peers.peer import CHANNELS, PATIENCE_S, RATE_HZ, Feeding, batches, free_port, program, taken, until
from tests.support.peers.plc import RingPeer

SECRET = "correct horse battery"


@pytest.fixture(scope="module")
def pki(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an authority, what it signed for the broker and for us, another authority, and a password file."""
    folder = tmp_path_factory.mktemp("pki")
    folder.chmod(0o755)
    ours, other = Authority(folder, "authority"), Authority(folder, "other")
    ours.sign("broker")
    ours.sign("client")
    other.sign("stranger")
    self_signed(folder, "server", "urn:freeopcua:python:server")
    self_signed(folder, "us", "urn:example.org:FreeOpcUa:opcua-asyncio")
    self_signed(folder, "them", "urn:freeopcua:python:server")
    (folder / "users").write_text(f"plc:{SECRET}\n")
    mosquitto = Path(program("mosquitto"))
    subprocess.run([mosquitto.parent / "../bin/mosquitto_passwd", "-U", folder / "users"], check=True)
    (folder / "users").chmod(0o644)
    (folder / "password").write_text(SECRET + "\n")
    return folder


@pytest.fixture
def broker(pki: Path, tmp_path: Path):
    """mosquitto that wants a certificate of its authority and a password."""
    lines = (
        f"cafile {pki / 'authority.crt'}", f"certfile {pki / 'broker.crt'}", f"keyfile {pki / 'broker.key'}",
        "require_certificate true", f"password_file {pki / 'users'}",
    )  # fmt: skip
    with Mosquitto(tmp_path, lines) as found:
        yield found


def settings(broker: Mosquitto, pki: Path, **changes: object) -> dict[str, object]:
    given = {
        "url": f"mqtts://127.0.0.1:{broker.port}/{TOPIC}",
        "ca_file": pki / "authority.crt",
        "certificate_file": pki / "client.crt",
        "key_file": pki / "client.key",
        "username": "plc",
        "password_file": pki / "password",
        "reorder_batches": 0,
        "timeout_s": 20.0,
    } | changes
    return {key: value for key, value in given.items() if value is not None}


def test_mqtt_with_certificates_and_a_password_delivers_the_samples(broker, pki):
    given = batches(20)
    context = ssl.create_default_context(cafile=pki / "authority.crt")
    context.load_cert_chain(pki / "client.crt", pki / "client.key")
    client = publisher(broker.port, context, ("plc", SECRET))

    def script() -> None:
        until(lambda: broker.logged("Sending SUBACK"), "a subscription")
        client.publish(TOPIC, encode_layout(CHANNELS, RATE_HZ), qos=1)
        for batch in given:
            client.publish(TOPIC, encode_samples(batch, double=True), qos=1)

    with Feeding(script), open_source(SourceSettings(**settings(broker, pki))) as source:
        parts = []
        for block in source.blocks():
            parts.append(block["y"])
            if block["w"][-1] == given[-1].stop - 1:
                break
        published = repr(source.take_events()) + repr(source.health)
    stop(client)
    np.testing.assert_array_equal(np.concatenate(parts), np.concatenate([batch.data[1] for batch in given]))
    assert SECRET not in published


@pytest.mark.parametrize(
    ("changes", "remedy", "attempts"),
    [
        ({"ca_file": "other.crt"}, "check source.ca_file", 1),
        ({"username": "somebody"}, "check source.username", 1),
        ({"password_file": "users"}, "check source.username", 1),
        ({"certificate_file": "stranger.crt", "key_file": "stranger.key"}, "if it requires a certificate", 3),
        ({"certificate_file": None, "key_file": None}, "if it requires a certificate", 3),
    ],
)
def test_mqtt_refusals_are_reported_once(broker, pki, changes, remedy, attempts):
    changes = {key: value if value is None or key == "username" else pki / value for key, value in changes.items()}
    before = broker.logged("New connection")
    with pytest.raises(SourceError) as caught:
        open_source(SourceSettings(**settings(broker, pki, **changes)))
    assert caught.value.code == "source.refused"
    assert caught.value.place == f"mqtts://127.0.0.1:{broker.port}/{TOPIC}"
    assert caught.value.remedy.startswith(remedy)
    assert SECRET not in repr(caught.value.as_dict())
    assert broker.logged("New connection") - before <= attempts


def opcua(peer: OpcUaPeer, pki: Path, **changes: object) -> SourceSettings:
    given = {
        "username": "plc",
        "password_file": pki / "password",
        "security": "Basic256Sha256",
        "certificate_file": pki / "us.der",
        "key_file": pki / "us.pem",
        "server_certificate_file": pki / "server.der",
        "timeout_s": 20.0,
    } | changes
    return SourceSettings(**peer.settings, **given)


def test_opc_ua_signed_and_encrypted(pki, tmp_path):
    given = batches(20)
    with OpcUaPeer(tmp_path, pki, ("plc", SECRET)) as peer:

        def script() -> None:
            peer.wait_ready()
            for batch in given:
                peer.send(batch)

        with Feeding(script), open_source(opcua(peer, pki)) as source:
            parts = []
            for block in source.blocks():
                parts.append(block["y"])
                if block["w"][-1] == given[-1].stop - 1:
                    break
            published = repr(source.take_events()) + repr(source.health)
    np.testing.assert_array_equal(np.concatenate(parts), np.concatenate([batch.data[1] for batch in given]))
    assert SECRET not in published


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"server_certificate_file": "them.der"}, "key"),
        ({"password_file": "users"}, "status"),
    ],
)
def test_opc_ua_refusals_are_reported_once(pki, tmp_path, changes, fact):
    with OpcUaPeer(tmp_path, pki, ("plc", SECRET)) as peer, pytest.raises(SourceError) as caught:
        open_source(opcua(peer, pki, **{key: pki / value for key, value in changes.items()}))
    assert (caught.value.code, list(caught.value.facts)) == ("source.refused", [fact])
    assert SECRET not in repr(caught.value.as_dict())


def test_a_node_that_is_not_there_is_refused(tmp_path):
    with (
        OpcUaPeer(tmp_path) as peer,
        refused(SourceError, "refused", node="ns=2;s=axis.z", status="BadNodeIdUnknown"),
    ):
        open_source(SourceSettings(**peer.settings | {"nodes": {"w": "ns=2;s=axis.z"}, "timeout_s": 20.0}))


def test_secrets_stay_out_of_the_configuration_that_is_recorded(tmp_path, monkeypatch):
    monkeypatch.setenv("PLC_PASSWORD", SECRET)
    (tmp_path / "axis.toml").write_text(
        '[source]\nurl = "mqtt://h/t"\nusername = "plc"\npassword_env = "PLC_PASSWORD"\n[signals]\noutput = "y"\n'
    )
    axis = Axis.read(tmp_path / "axis.toml")
    assert SECRET not in repr(axis) + json.dumps(axis.model_dump(mode="json"))


@pytest.mark.parametrize(
    ("given", "code", "facts"),
    [
        (
            {"password_env": "NOT_SET_ANYWHERE"},
            "secret-missing",
            {"key": "source.password_env"},
        ),
        ({"password_file": "/nowhere"}, "file-unreadable", {"key": "source.password_file"}),
        (
            {"password_env": "A", "password_file": "B"},
            "key-conflict",
            {"key": "source", "keys": ["password_env", "password_file"]},
        ),
    ],
)
def test_missing_secrets_are_refused_without_repeating_their_names(given, code, facts):
    with refused(ConfigError, code, **facts):
        open_source(SourceSettings(url="mqtt://127.0.0.1:1/t", **given))
    with pytest.raises(ConfigError) as caught:  # in place of a name may be the password
        open_source(SourceSettings(url="mqtt://127.0.0.1:1/t", **given))
    assert not {"NOT_SET_ANYWHERE", "nowhere"} & set(re.findall(r"\w+", repr(caught.value.as_dict())))


@pytest.mark.parametrize(
    ("given", "code", "facts"),
    [
        ({}, "key-missing", {"keys": ["url"]}),
        ({"url": "mqtt://h/a/+"}, "value-invalid", {"key": "source.url", "value": "a/+"}),
        ({"url": "mqtt://h"}, "value-invalid", {"key": "source.url", "value": ""}),
        (
            {"url": "mqtts://h/t", "ca_file": "/nowhere"},
            "file-unreadable",
            {"key": "source.ca_file", "path": "/nowhere"},
        ),
        ({"url": "opc.tcp://h", "rate_hz": 1.0}, "key-missing", {"keys": ["nodes", "rate_hz"]}),
        (
            {"url": "opc.tcp://h", "rate_hz": 1.0, "nodes": {"w": "rubbish"}},
            "value-invalid",
            {"key": "source.nodes", "value": "rubbish"},
        ),
        (
            {"url": "opc.tcp://h", "rate_hz": 1.0, "nodes": {"w": "i=1"}, "key_file": "k"},
            "key-missing",
            {"keys": ["security"]},
        ),
        (
            {"url": "opc.tcp://h", "rate_hz": 1.0, "nodes": {"w": "i=1"}, "security": "Basic256Sha256"},
            "key-missing",
            {"keys": ["certificate_file", "key_file", "server_certificate_file"]},
        ),
        ({"url": "udp://127.0.0.1:1", "sender": "drive"}, "value-invalid", {"key": "source.sender", "value": "drive"}),
        ({"url": "ads://h"}, "key-missing", {"keys": ["net_id", "symbol", "channels"]}),
        (
            {"url": "ads://h", "net_id": "1.2", "symbol": "MAIN.x", "channels": ["w"]},
            "value-invalid",
            {"key": "source.net_id", "value": "1.2"},
        ),
        (
            {"url": "ads://h", "net_id": "1.2.3.4.1.1", "symbol": "M.x", "channels": ["w"], "mode": "notify"},
            "key-missing",
            {"keys": ["rate_hz"]},
        ),
    ],
)
def test_impossible_settings_of_a_source_are_refused(given, code, facts):
    with refused(ConfigError, code, **facts):
        open_source(SourceSettings(**given))


@pytest.mark.parametrize("interface", ["127.0.0.1", "::"])
def test_datagrams_of_others_than_the_sender_are_dropped_and_named(interface):
    port, given = free_port(socket.SOCK_DGRAM), batches(40, epoch=5)
    host = f"[{interface}]" if ":" in interface else interface
    settings = SourceSettings(url=f"udp://{host}:{port}", sender="127.0.0.2", timeout_s=PATIENCE_S)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mine, socket.socket(type=socket.SOCK_DGRAM) as other:
        mine.bind(("127.0.0.2", 0))
        other.bind(("127.0.0.3", 0))

        def send() -> None:
            for ours, strange in zip(given, batches(40, epoch=6)):
                for link, batch in ((other, strange), (mine, ours)):
                    link.sendto(encode_layout(CHANNELS, RATE_HZ), ("127.0.0.1", port))
                    link.sendto(encode_samples(batch, double=True), ("127.0.0.1", port))
                time.sleep(0.01)

        with Feeding(send), open_source(settings) as source:
            epochs = {block.origin.epoch for block in taken(source.blocks(), 10)}
            events = [event for event in source.take_events() if event.kind == "foreign"]
    assert epochs == {5}
    assert events[0].message == "a datagram from 127.0.0.3 was dropped; source.sender is 127.0.0.2"


def test_a_plc_is_asked_at_the_port_and_from_the_net_id_that_are_configured(tmp_path):
    with RingPeer(tmp_path) as peer:

        def script() -> None:
            peer.wait_ready()
            for one in batches(4, epoch=3):
                peer.send(one)

        ports = {"ams_port": 852, "local_net_id": "5.6.7.8.1.1"}
        with Feeding(script), make_source(SourceSettings(**peer.settings | ports)).open() as source:
            assert next(source.blocks()).rate_hz == RATE_HZ
        headers = [packet.ams_header for packet in peer._server.request_history]
    assert {one.target_port for one in headers} == {struct.pack("<H", 852)}
    assert {one.source_net_id for one in headers} == {bytes([5, 6, 7, 8, 1, 1])}


def test_an_answer_of_a_plc_that_is_too_short_is_a_connection_that_is_tried_again(tmp_path):
    """As a PLC gives while its program is loaded anew."""

    class ShortPeer(RingPeer):
        def _prepare(self) -> None:
            super()._prepare()
            answer, self.short = self._memory.get_variable_by_indices, True

            def shortened(group: int, offset: int) -> PLCVariable:
                found = answer(group, offset)
                if self.short:
                    return PLCVariable("part", bytes(found.value[:7]), found.ads_type, "")
                return found

            self._memory.get_variable_by_indices = shortened

    with ShortPeer(tmp_path) as peer:

        def script() -> None:
            peer.wait_ready()
            until(lambda: source._outage, "the short answer to be noticed")
            peer.short = False
            for batch in batches(4, epoch=3):
                peer.send(batch)

        source = make_source(SourceSettings(**peer.settings | {"timeout_s": PATIENCE_S}))
        with Feeding(script), source.open():
            assert next(source.blocks()).rate_hz == RATE_HZ
        (event,) = [event for event in source.take_events() if event.kind == "disconnected"]
    assert "the PLC's answer is invalid" in event.message
