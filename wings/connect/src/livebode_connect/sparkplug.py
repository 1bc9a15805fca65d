"""SparkplugSink: results as an edge node of Sparkplug B 3.0; each axis is a device."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import Any

from livebode.core import ConfigError
from livebode.publishing import AxisValues, EventMessage, PublishSection
from livebode_connect.mqtt import level
from livebode_connect.mqtt_link import Message, MqttLink
from livebode_connect.sparkplug_payload import BOOLEAN, DOUBLE, STRING, UINT64, Metric, commands, payload

REBIRTH = "Node Control/Rebirth"
_COUNTS = ("samples", "responses", "lost")


class SparkplugSink:
    """An edge node: NBIRTH and NDEATH with bdSeq, DBIRTH for each axis, DDATA with what has changed, and rebirth.

    Sparkplug sends data with quality of service 0, so that nobody confirms them: a host asks for a rebirth where a
    number of the sequence is missing.
    """

    events_at_once = 1
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        self._link = MqttLink(section, self._death, self._begin)
        levels = self._link.path.split("/")
        if len(levels) != 2 or not all(levels) or level("".join(levels)) != "".join(levels):
            raise ConfigError(
                "value-invalid",
                "publish.url of kind sparkplug has no group and node",
                "write mqtt://broker/GROUP/NODE",
                key="publish.url",
            )
        self._group, self._node = levels
        # The death of a previous process is recognised by another number than that of this one.
        self._bd_seq, self._seq = int(time.time()) % 256, 0
        self._born: dict[str, list[Metric]] = {}
        self._lock = threading.RLock()  # a lost connection is made again, with births, while data are sent

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Nothing: the active alarms are metrics."""

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Publish what has changed of each axis, or its birth."""
        self._link.connected()
        with self._lock:
            self._link.publish([message for one in values if (message := self._device(one)) is not None], qos=0)

    def close(self) -> None:
        """Publish the death, and disconnect."""
        self._link.close(self._death(new=False))

    def _device(self, values: AxisValues) -> Message | None:
        """The message of an axis; None if nothing has changed."""
        name, metrics = level(values.axis), metrics_of(values)
        before, self._born[name] = self._born.get(name), metrics
        if before is None or [m.name for m in before] != [m.name for m in metrics]:
            return self._message("DBIRTH", metrics, name, units=True)
        changed = [metric for metric, old in zip(metrics, before) if metric != old]
        return self._message("DDATA", changed, name) if changed else None

    def _message(self, kind: str, metrics: Sequence[Metric], device: str = "", *, units: bool = False) -> Message:
        topic = f"spBv1.0/{self._group}/{kind}/{self._node}" + (f"/{device}" if device else "")
        self._seq = 0 if kind == "NBIRTH" else (self._seq + 1) % 256
        return topic, payload(metrics, _now_ms(), self._seq, units=units), False

    def _death(self, *, new: bool = True) -> Message:
        if new:
            self._bd_seq = (self._bd_seq + 1) % 256
        metrics = [Metric("bdSeq", UINT64, self._bd_seq)]
        return f"spBv1.0/{self._group}/NDEATH/{self._node}", payload(metrics, _now_ms(), None), False

    def _begin(self, client: Any) -> None:
        client.on_message = self._command
        client.subscribe(f"spBv1.0/{self._group}/NCMD/{self._node}", qos=1)
        with self._lock:
            self._births(client)
            self._born.clear()

    def _births(self, client: Any) -> None:
        """The birth of the node, and those of the devices that are known."""
        node = [Metric("bdSeq", UINT64, self._bd_seq), Metric(REBIRTH, BOOLEAN, False)]
        messages = [self._message("NBIRTH", node)]
        messages += [self._message("DBIRTH", metrics, name, units=True) for name, metrics in self._born.items()]
        for topic, content, kept in messages:
            client.publish(topic, content, qos=0, retain=kept)

    def _command(self, client: Any, _data: Any, message: Any) -> None:
        """In the thread of the client: a host that missed something asks for all births."""
        if commands(message.payload).get(REBIRTH):
            with self._lock:
                self._births(client)


def metrics_of(values: AxisValues) -> list[Metric]:
    """The results of an axis as metrics."""
    found = [Metric("Alarms/active", UINT64, len(values.alarms))]
    newest = max(values.alarms, key=lambda alarm: alarm.unix_s, default=None)
    found.append(Metric("Alarms/newest", STRING, "" if newest is None else newest.message))
    for one in values.measurements:
        found.append(Metric(f"Parameters/{one.name}", DOUBLE, one.value, one.unit))
        found.append(Metric(f"Parameters/{one.name} bound", DOUBLE, one.bound, one.unit))
    for name, value in values.status.items():
        datatype = STRING if isinstance(value, str) else UINT64 if name in _COUNTS else DOUBLE
        found.append(Metric(f"Status/{name}", datatype, value))
    return found


def _now_ms() -> int:
    return int(1e3 * time.time())
