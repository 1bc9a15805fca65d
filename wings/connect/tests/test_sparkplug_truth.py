"""An edge node of Sparkplug B at a real broker, read by Google's Protocol Buffers with the specified fields."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import ConfigError
from livebode.publishing import open_sink
from livebode_connect.sparkplug import BOOLEAN, DOUBLE, STRING, UINT64, Metric, payload
from tests.support.errors import refused
from tests.support.peers.broker import Mosquitto, publisher, stop
from tests.support.receivers import PublishedAxis, configured, until

UINT, ULONG, REAL, TRUTH, TEXT, PART = 13, 4, 1, 8, 9, 11  # types of a field in descriptor.proto
MESSAGES = {
    "PropertyValue": {"type": (1, UINT), "string_value": (8, TEXT)},
    "PropertySet": {"keys": (1, TEXT, True), "values": (2, "PropertyValue", True)},
    "Metric": {
        "name": (1, TEXT), "timestamp": (3, ULONG), "datatype": (4, UINT), "is_null": (7, TRUTH),
        "properties": (9, "PropertySet"), "long_value": (11, ULONG), "double_value": (13, REAL),
        "boolean_value": (14, TRUTH), "string_value": (15, TEXT),
    },
    "Payload": {"timestamp": (1, ULONG), "metrics": (2, "Metric", True), "seq": (3, ULONG)},
}  # fmt: skip


def payload_class() -> Any:
    file = descriptor_pb2.FileDescriptorProto(name="sparkplug.proto", package="b", syntax="proto2")
    for name, fields in MESSAGES.items():
        message = file.message_type.add(name=name)
        for field, (number, kind, *repeated) in fields.items():
            label = 3 if repeated else 1
            own = {"type": PART, "type_name": f".b.{kind}"} if isinstance(kind, str) else {"type": kind}
            message.field.add(name=field, number=number, label=label, **own)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("b.Payload"))


PAYLOAD = payload_class()
FIELDS = {UINT64: "long_value", DOUBLE: "double_value", BOOLEAN: "boolean_value", STRING: "string_value"}
VALUES = {
    UINT64: st.integers(0, 2**64 - 1), DOUBLE: st.floats(allow_nan=False), BOOLEAN: st.booleans(),
    STRING: st.text(st.characters(codec="utf-8"), max_size=200),
}  # fmt: skip


@st.composite
def some_metrics(draw: st.DrawFn) -> Metric:
    datatype = draw(st.sampled_from(sorted(VALUES)))
    text = st.text(st.characters(codec="utf-8"), max_size=20)
    return Metric(draw(text), datatype, draw(st.none() | VALUES[datatype]), draw(text))


@settings(max_examples=60)
@given(st.lists(some_metrics(), max_size=4), st.integers(0, 2**63), st.integers(0, 255))
def test_protocol_buffers_read_what_is_written(metrics: list[Metric], unix_ms: int, seq: int) -> None:
    found = PAYLOAD.FromString(payload(metrics, unix_ms, seq, units=True))
    assert (found.timestamp, found.seq, len(found.metrics)) == (unix_ms, seq, len(metrics))
    for one, metric in zip(found.metrics, metrics):
        assert (one.name, one.datatype) == (metric.name, metric.datatype)
        assert one.is_null == (metric.value is None)
        assert metric.value is None or getattr(one, FIELDS[metric.datatype]) == metric.value
        assert [value.string_value for value in one.properties.values] == ([metric.unit] if metric.unit else [])


class Host:
    """A host application: all messages of a group in their order."""

    def __init__(self, port: int) -> None:
        self.messages: list[tuple[str, Any]] = []
        self.client = publisher(port)
        self.client.on_message = lambda _client, _data, message: self.messages.append(
            (message.topic.removeprefix("spBv1.0/plant/"), PAYLOAD.FromString(message.payload))
        )
        self.client.subscribe("spBv1.0/plant/#", qos=1)

    def __enter__(self) -> Host:
        return self

    def __exit__(self, *_: object) -> None:
        stop(self.client)

    def of(self, topic: str) -> list[Any]:
        return [found for name, found in self.messages if name == topic]

    def ask_for_rebirth(self) -> None:
        command = PAYLOAD()
        metric = command.metrics.add(name="Node Control/Rebirth", datatype=BOOLEAN)
        metric.boolean_value = True
        self.client.publish("spBv1.0/plant/NCMD/line", command.SerializeToString(), qos=1)


def value(message: Any, name: str) -> Any:
    (metric,) = [metric for metric in message.metrics if metric.name == name]
    return getattr(metric, FIELDS[metric.datatype])


def names(message: Any) -> set[str]:
    return {metric.name for metric in message.metrics}


def test_a_host_sees_births_data_rebirths_and_the_death(tmp_path: Path) -> None:
    with Mosquitto(tmp_path) as broker, Host(broker.port) as host:
        url = f"mqtt://127.0.0.1:{broker.port}/plant/line"
        with PublishedAxis(tmp_path, {"kind": "sparkplug", "url": url, "interval_s": 0.1}) as axis:
            axis.measure()
            births = partial(host.of, "DBIRTH/line/x")
            until(
                lambda: any(names(birth) & {"Parameters/Keff"} for birth in births()), "the birth with its parameters"
            )
            axis.change(-2.0)
            data = until(lambda: host.of("DDATA/line/x"), "data")
            assert len(host.of("NBIRTH/line")) == 1
            born_before = len(births())
            host.ask_for_rebirth()
            until(lambda: len(host.of("NBIRTH/line")) == 2, "the rebirth")
            until(lambda: len(births()) > born_before, "the device's")
        death = until(lambda: host.of("NDEATH/line"), "the death")[0]
    node, device = host.of("NBIRTH/line")[0], host.of("DBIRTH/line/x")[-1]
    assert value(node, "bdSeq") == value(death, "bdSeq")
    assert (node.seq, death.HasField("seq")) == (0, False)
    born = [name for name, _ in host.messages if name.startswith(("NBIRTH", "NDEATH"))]
    assert born == ["NBIRTH/line", "NBIRTH/line", "NDEATH/line"]
    sequence = [found.seq for name, found in host.messages if not name.startswith(("NDEATH", "NCMD"))]
    again = sequence.index(0, 1)
    assert sequence == [*range(again), *range(len(sequence) - again)]  # no gap, and from 0 with each birth of the node
    assert value(data[-1], "Alarms/active") == 1
    (keff,) = [metric for metric in device.metrics if metric.name == "Parameters/Keff"]
    assert keff.double_value > 0
    assert [one.string_value for one in keff.properties.values] == ["N m/rad"]
    assert list(keff.properties.keys) == ["engUnit"]


def test_the_address_names_group_and_node() -> None:
    for path in ("", "/plant", "/plant/line/x", "/plant/+"):
        (section,) = configured({"kind": "sparkplug", "url": f"mqtt://127.0.0.1{path}"}).publish
        with refused(ConfigError, "value-invalid", key="publish.url"):
            open_sink(section)
