"""The server of OPC UA, as a client of asyncua reads and subscribes it."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from datetime import UTC
from pathlib import Path
from typing import Any

import pytest
import trustme
from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

import livebode
from livebode.core import ConfigError, Event
from tests.support.certificates import certified
from tests.support.peers.peer import PATIENCE_S
from tests.support.receivers import PublishedAxis, free_port

AXIS = ["0:Objects", "2:livebode", "2:x"]


class Events:
    """What a subscription of events gets."""

    def __init__(self) -> None:
        self.found: list[Any] = []

    def event_notification(self, event: Any) -> None:
        self.found.append(event)


async def happened(what: Any) -> Any:
    """The result of a question, or of a coroutine's function, as soon as it is something."""
    ends_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < ends_s:
        try:
            found = what()
            found = await found if asyncio.iscoroutine(found) else found
        except (OSError, ua.UaError):
            found = None
        if found:
            return found
        await asyncio.sleep(0.02)
    raise AssertionError("it did not happen")


async def connected(url: str, **login: str) -> Client:
    client = Client(url, timeout=PATIENCE_S)
    if login:
        client.set_user(login["user"])
        client.set_password(login["password"])
    await client.connect()
    return client


async def read(url: str, axis: PublishedAxis) -> dict[str, Any]:
    client = await happened(lambda: connected(url))
    try:
        place = await happened(lambda: client.nodes.root.get_child([*AXIS, "2:Parameters", "2:Keff"]))
        found: dict[str, Any] = {"data": await place.read_data_value()}
        for name in ("EngineeringUnits", "Bound"):
            found[name] = await (await place.get_child([f"2:{name}"])).read_value()
        response = await client.nodes.root.get_child([*AXIS, "2:Response", "2:frequency_hz"])
        found["frequency_hz"] = await response.read_value()
        with pytest.raises(ua.UaStatusCodeError):
            await place.write_value(0.0)
        with pytest.raises(ua.UaStatusCodeError):
            await client.nodes.objects.add_object(2, "foreign")
        result = [*AXIS, "3:ResultManagement", "3:Results", "3:Newest"]
        newest = await client.nodes.root.get_child(result)
        found["types"] = [await newest.read_type_definition()]
        found["types"].append(await (await client.nodes.root.get_child(result[:-2])).read_type_definition())
        for name in ("ResultContent", "ResultMetaData/ResultId", "ResultMetaData/CreationTime"):
            place = await newest.get_child([f"3:{part}" for part in name.split("/")])
            found[name.split("/")[-1]] = await place.read_value()
        found["namespace"] = (await client.get_namespace_array())[3]
        events = Events()
        subscription = await client.create_subscription(50, events)
        types = [ua.ObjectIds.BaseEventType, ua.ObjectIds.OffNormalAlarmType]
        await subscription.subscribe_events(client.nodes.server, types)
        axis.change(-2.0, 3)
        axis.feed(Event("change-cleared", 4, 4.0, "as before", {"what": "stiffness"}))
        axis.feed(Event("fit-failed", 5, 5.0, "no fit"))
        await happened(lambda: len(events.found) == 3)
        found["events"] = events.found
        await subscription.delete()
    finally:
        await client.disconnect()
    return found


def test_a_client_reads_parameters_with_units_and_is_told_of_alarms(tmp_path: Path) -> None:
    url = f"opc.tcp://127.0.0.1:{free_port()}"
    section = {"kind": "opcua", "url": url, "interval_s": 0.1, "values": ["parameters", "responses", "status"]}
    with PublishedAxis(tmp_path, section) as axis:
        axis.measure()
        found = asyncio.run(read(url, axis))
    fits = livebode.Fitter("two-mass").process(livebode.example_responses()[-2:])
    assert found["data"].Value.Value == fits["Keff"][-1]
    assert found["data"].SourceTimestamp.timestamp() == pytest.approx(1.8e9 + fits.time_s[-1], abs=1e-3)
    assert found["Bound"] == fits.bound(0.95)[-1, fits.index("Keff")]
    assert found["EngineeringUnits"].DisplayName.Text == "N m/rad"
    assert found["frequency_hz"] == [float(f) for f in range(20, 141, 10)]
    assert found["namespace"] == "http://opcfoundation.org/UA/Machinery/Result/"
    assert found["types"] == [ua.NodeId(2001, 3), ua.NodeId(1004, 3)]
    (content,) = map(json.loads, found["ResultContent"])
    assert {one["name"]: one["value"] for one in content["measurements"]}["Keff"] == fits["Keff"][-1]
    assert content["response"]["frequency_hz"] == found["frequency_hz"]
    assert found["ResultId"] == f"x run {content['time']}"
    assert found["CreationTime"].replace(tzinfo=UTC).timestamp() == pytest.approx(content["unix_s"], abs=1e-3)
    alarm, ended, event = found["events"]
    assert [one.Message.Text for one in found["events"]] == ["stiffness -2.0 % (no. 3)", "as before", "no fit"]
    assert [one.Severity for one in found["events"]] == [900, 900, 100]
    assert (alarm.Retain, ended.Retain) == (True, False)
    assert alarm.ConditionName == ended.ConditionName == "change: stiffness"
    assert alarm.EventType == ua.NodeId(ua.ObjectIds.OffNormalAlarmType)
    assert event.EventType == ua.NodeId(ua.ObjectIds.BaseEventType)


def test_only_the_user_with_the_password_is_let_in_as_soon_as_the_port_is_free(tmp_path: Path) -> None:
    port = free_port()
    url = f"opc.tcp://127.0.0.1:{port}"
    (tmp_path / "password").write_text("right")
    login = {"username": "reader", "password_file": str(tmp_path / "password")}

    async def tries() -> None:
        await happened(lambda: axis.reported("sink-down"))
        other.close()
        client = await happened(lambda: connected(url, user="reader", password="right"))
        await client.disconnect()
        for wrong in ({"user": "reader", "password": "wrong"}, {"user": "other", "password": "right"}, {}):
            with pytest.raises(ua.UaStatusCodeError):
                await connected(url, **wrong)

    other = socket.create_server(("127.0.0.1", port))  # until the receiver is reported as down
    with PublishedAxis(tmp_path, {"kind": "opcua", "url": url, "interval_s": 0.1} | login) as axis:
        axis.measure()
        asyncio.run(tries())


def test_with_a_certificate_only_encrypted_connections_are_taken(tmp_path: Path) -> None:
    files = certified(tmp_path / "tls", trustme.CA(), trustme.KeyType.RSA)
    url = f"opc.tcp://127.0.0.1:{free_port()}"
    section = {"kind": "opcua", "url": url, "interval_s": 0.1}
    section |= {"certificate_file": str(files["certificate"]), "key_file": str(files["key"])}

    async def encrypted() -> Client:
        client = Client(url, timeout=10)
        own = str(files["certificate"]), str(files["key"]), str(files["certificate"])
        await client.set_security(SecurityPolicyBasic256Sha256, own[0], own[1], server_certificate=own[2])
        await client.connect()
        return client

    async def tries() -> float:
        client = await happened(encrypted)
        keff = await happened(lambda: client.nodes.root.get_child([*AXIS, "2:Parameters", "2:Keff"]))
        value = await keff.read_value()
        await client.disconnect()
        with pytest.raises(ua.UaError):
            await connected(url)
        return float(value)

    with PublishedAxis(tmp_path, section) as axis:
        axis.measure()
        found = asyncio.run(tries())
    assert found == livebode.Fitter("two-mass").process(livebode.example_responses()[-2:])["Keff"][-1]


def test_a_certificate_with_another_kind_of_key_is_refused_at_the_start(tmp_path: Path) -> None:
    files = certified(tmp_path / "tls", trustme.CA())
    section = {"kind": "opcua", "url": "opc.tcp://127.0.0.1:4840", "certificate_file": str(files["certificate"])}
    with pytest.raises(ConfigError, match="is not one of RSA, which Basic256Sha256 of OPC UA requires"):
        PublishedAxis(tmp_path, section | {"key_file": str(files["key"])})
