"""MqttSink: events and results as JSON on the topics of a broker; Home Assistant finds them by itself."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Iterator, Sequence
from typing import Any

from livebode.configuration.publish_section import PublishSection
from livebode.core import PublishError
from livebode.core.installing import not_installed
from livebode.publishing.failures import unreachable
from livebode.publishing.messages import AxisValues, EventMessage
from livebode.publishing.secrets import address, client_tls, password
from livebode.version import __version__

BASE = "livebode"
DISCOVERY = "homeassistant"
_KEEPALIVE_S = 30
_NOT_IN_TOPIC = re.compile(r"[+#/\x00-\x1f\x7f]")
_NOT_IN_ID = re.compile(r"[^A-Za-z0-9_-]")
Message = tuple[str, bytes, bool]
"""Topic, payload, and whether the broker keeps it for new subscribers."""


class MqttSink:
    """A broker. Every message has quality of service 1, so that the broker confirms it.

    Below the path of the URL: ``AXIS/event`` (each event), ``AXIS/values`` and ``AXIS/response`` (the newest,
    retained), and ``state``, which is ``online`` or ``offline``, also after a kill.
    """

    events_at_once = 50
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        try:
            from paho.mqtt import client
        except ImportError:
            raise not_installed("MQTT needs paho-mqtt, which is not installed", "paho-mqtt", "mqtt") from None
        self._mqtt: Any = client
        self._section = section
        self._scheme, self._host, self._port, path = address(section)
        self._base = path.strip("/") or BASE
        self._client: Any = None
        self._described: set[str] = set()
        password(section)
        if self._scheme == "mqtts":
            client_tls(section)

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Publish each."""
        topics = ((f"{self._base}/{_level(event.axis)}/event", event.plain()) for event in events)
        self._publish([(topic, _json(content), False) for topic, content in topics])

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Publish the newest results, and what Home Assistant needs where it is new."""
        for one in values:
            messages = [*messages_of(one, self._base)]
            if self._section.discovery:
                described = [*discovery_of(one, self._base)]
                new = [message for message in described if message[0] not in self._described]
                self._publish(new)
                self._described |= {topic for topic, _, _ in new}
            self._publish(messages)

    def close(self) -> None:
        """Report the end, and disconnect."""
        if self._client is None:
            return
        client, self._client = self._client, None
        if client.is_connected():
            client.publish(f"{self._base}/state", b"offline", qos=1, retain=True).wait_for_publish(1.0)
        client.disconnect()
        client.loop_stop()

    def _publish(self, messages: Sequence[Message]) -> None:
        """Publish these, and wait until the broker has confirmed them all."""
        client = self._connected()
        sent = [client.publish(topic, payload, qos=1, retain=kept) for topic, payload, kept in messages]
        try:
            for one in sent:
                one.wait_for_publish(self._section.timeout_s)
                if not one.is_published():
                    raise TimeoutError
        except (RuntimeError, ValueError, TimeoutError) as error:
            self._drop()
            gone = isinstance(error, TimeoutError) and client.is_connected()
            wrong = error if gone else ConnectionError("the broker closed the connection")
            raise unreachable(wrong, self._section.timeout_s) from None

    def _connected(self) -> Any:
        if self._client is not None and self._client.is_connected():
            return self._client
        self._drop()
        client, answered = self._new_client()
        try:
            client.connect(self._host, self._port, _KEEPALIVE_S)
            client.loop_start()
            self._client = client
            reason = answered(self._section.timeout_s)
        except OSError as error:
            self._drop()
            raise unreachable(error, self._section.timeout_s) from None
        if reason.is_failure:
            self._drop()
            raise PublishError(
                "refused", f"the broker rejects the connection: {reason}", "check publish.username and its password"
            )
        client.publish(f"{self._base}/state", b"online", qos=1, retain=True)
        self._described.clear()  # a broker that was restarted may have kept nothing
        return client

    def _new_client(self) -> tuple[Any, Any]:
        """A client, and a function that waits for the answer to its connection."""
        import queue

        client = self._mqtt.Client(self._mqtt.CallbackAPIVersion.VERSION2, reconnect_on_failure=False)
        client.connect_timeout = self._section.timeout_s
        reasons: queue.SimpleQueue[Any] = queue.SimpleQueue()
        client.on_connect = lambda _client, _data, _flags, reason, _properties: reasons.put(reason)
        client.on_socket_open = lambda _client, _data, link: link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client.will_set(f"{self._base}/state", b"offline", qos=1, retain=True)
        secret = password(self._section)
        if self._section.username is not None or secret is not None:
            client.username_pw_set(self._section.username or "", secret)
        if self._scheme == "mqtts":
            client.tls_set_context(client_tls(self._section))

        def answered(timeout_s: float) -> Any:
            try:
                return reasons.get(timeout=timeout_s)
            except queue.Empty:
                raise TimeoutError from None

        return client, answered

    def _drop(self) -> None:
        """End a connection that is of no use."""
        if self._client is not None:
            client, self._client = self._client, None
            client.on_socket_close = None
            client.disconnect()
            client.loop_stop()


def messages_of(values: AxisValues, base: str) -> Iterator[Message]:
    """The results of an axis, retained."""
    above = f"{base}/{_level(values.axis)}"
    plain = values.plain()
    response = plain.pop("response")
    plain["parameters"] = {one.pop("name"): one for one in plain.pop("measurements")}
    about = {name: plain.pop(name) for name in ("quantity", "unit")}
    yield f"{above}/values", _json(plain), True
    if response is not None:
        yield f"{above}/response", _json(about | {"time": plain["time"]} | response), True


def discovery_of(values: AxisValues, base: str) -> Iterator[Message]:
    """What Home Assistant reads to find the quantities of an axis: a sensor for each, and one for the alarms."""
    device = {
        "identifiers": [f"livebode_{_id(values.machine)}_{_id(values.axis)}"],
        "name": " ".join(filter(None, (values.machine, values.axis))),
        "manufacturer": "livebode",
        "sw_version": __version__,
    }
    common = {
        "state_topic": f"{base}/{_level(values.axis)}/values",
        "availability_topic": f"{base}/state",
        "device": device,
        "origin": {"name": "livebode", "sw_version": __version__},
    }
    for one in values.measurements:
        sensor = {"name": one.name, "value_template": f"{{{{ value_json.parameters['{one.name}'].value }}}}"}
        unit = {"unit_of_measurement": one.unit} if one.unit else {}
        state = {"state_class": "measurement", "suggested_display_precision": 4}
        yield _entity("sensor", values, one.name, common | sensor | unit | state)
    for name, unit_text in (("samples", ""), ("responses", ""), ("lost", ""), ("latency_s", "s"), ("state", "")):
        if name in values.status:
            sensor = {"name": name, "value_template": f"{{{{ value_json.status.{name} }}}}"}
            more = {"entity_category": "diagnostic"} | ({"unit_of_measurement": unit_text} if unit_text else {})
            yield _entity("sensor", values, name, common | sensor | more)
    alarm = {
        "name": "alarm",
        "device_class": "problem",
        "value_template": "{{ 'ON' if value_json.alarms else 'OFF' }}",
        "json_attributes_topic": common["state_topic"],
        "json_attributes_template": "{{ {'alarms': value_json.alarms} | tojson }}",
    }
    yield _entity("binary_sensor", values, "alarm", common | alarm)


def _entity(kind: str, values: AxisValues, name: str, content: dict[str, Any]) -> Message:
    unique = f"livebode_{_id(values.machine)}_{_id(values.axis)}_{_id(name)}"
    return f"{DISCOVERY}/{kind}/{unique}/config", _json(content | {"unique_id": unique}), True


def _level(name: str) -> str:
    """A name as one level of a topic.

    >>> _level("axis/1 +")
    'axis_1 _'
    """
    return _NOT_IN_TOPIC.sub("_", name) or "axis"


def _id(name: str) -> str:
    return _NOT_IN_ID.sub("_", name) or "0"


def _json(content: Any) -> bytes:
    return json.dumps(content, ensure_ascii=False, allow_nan=False).encode()


SINK = MqttSink
