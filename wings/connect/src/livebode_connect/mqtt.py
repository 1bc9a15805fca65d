"""MqttSink: events and results as JSON on the topics of a broker; Home Assistant finds them by itself."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from typing import Any

from livebode import __version__
from livebode.publishing import AxisValues, EventMessage, PublishSection
from livebode_connect.mqtt_link import Message, MqttLink

BASE = "livebode"
DISCOVERY = "homeassistant"
_NOT_IN_TOPIC = re.compile(r"[+#/\x00-\x1f\x7f]")
_NOT_IN_ID = re.compile(r"[^A-Za-z0-9_-]")


class MqttSink:
    """A broker. Every message has quality of service 1, so that the broker confirms it.

    Below the path of the URL: ``AXIS/event`` (each event), ``AXIS/values`` and ``AXIS/response`` (the newest,
    retained), and ``state``, which is ``online`` or ``offline``, also after a kill.
    """

    events_at_once = 50
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        self._section = section
        self._link = MqttLink(section, self._offline, self._begin)
        self._base = self._link.path or BASE
        self._described: set[str] = set()

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Publish each."""
        topics = ((f"{self._base}/{level(event.axis)}/event", event.plain()) for event in events)
        self._link.publish([(topic, _json(content), False) for topic, content in topics])

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Publish the newest results, and what Home Assistant needs where it is new."""
        for value in values:
            messages = [*messages_of(value, self._base)]
            if self._section.discovery:
                described = [*discovery_of(value, self._base)]
                new = [message for message in described if message[0] not in self._described]
                self._link.publish(new)
                self._described |= {topic for topic, _, _ in new}
            self._link.publish(messages)

    def close(self) -> None:
        """Report the end, and disconnect."""
        self._link.close(self._offline())

    def _offline(self) -> Message:
        return f"{self._base}/state", b"offline", True

    def _begin(self, client: Any) -> None:
        client.publish(f"{self._base}/state", b"online", qos=1, retain=True)
        self._described.clear()  # a broker that was restarted may have kept nothing


def messages_of(values: AxisValues, base: str) -> Iterator[Message]:
    """The results of an axis, retained."""
    above = f"{base}/{level(values.axis)}"
    plain = values.plain()
    response = plain.pop("response")
    plain["parameters"] = {parameter.pop("name"): parameter for parameter in plain.pop("measurements")}
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
        "state_topic": f"{base}/{level(values.axis)}/values",
        "availability_topic": f"{base}/state",
        "device": device,
        "origin": {"name": "livebode", "sw_version": __version__},
    }
    for measurement in values.measurements:
        sensor = {
            "name": measurement.name,
            "value_template": f"{{{{ value_json.parameters['{measurement.name}'].value }}}}",
        }
        unit = {"unit_of_measurement": measurement.unit} if measurement.unit else {}
        state = {"state_class": "measurement", "suggested_display_precision": 4}
        yield _entity("sensor", values, measurement.name, common | sensor | unit | state)
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


def level(name: str) -> str:
    """A name as one level of a topic.

    >>> level("axis/1 +")
    'axis_1 _'
    """
    return _NOT_IN_TOPIC.sub("_", name) or "axis"


def _id(name: str) -> str:
    return _NOT_IN_ID.sub("_", name) or "0"


def _json(content: Any) -> bytes:
    return json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
