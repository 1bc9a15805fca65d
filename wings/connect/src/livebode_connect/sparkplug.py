"""SparkplugSink: results as an edge node of Sparkplug B 3.0; each axis is a device.

The numbers of the fields are those of the Sparkplug specification 3.0, section 6.4. The public libraries for Python
need paho-mqtt below version 2, and the schema is not under a licence of livebode's kind; the wire format of six fields
is shorter than either.
"""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Iterator, Sequence
from typing import Any

from livebode.core import ConfigError
from livebode.dataclass import dataclass
from livebode.publishing import AxisValues, EventMessage, PublishSection
from livebode_connect.mqtt import level
from livebode_connect.mqtt_link import Message, MqttLink

UINT64, DOUBLE, BOOLEAN, STRING = 8, 10, 11, 12
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
Value = int | float | bool | str


@dataclass(frozen=True)
class Metric:
    """A named value; None is the null of its type. `unit` is the property engUnit, sent with a birth."""

    name: str
    datatype: int
    value: Value | None
    unit: str = ""


def payload(metrics: Sequence[Metric], unix_ms: int, seq: int | None, *, units: bool = False) -> bytes:
    """A payload with these metrics; without `seq` that of a death."""
    parts = [_number(1, unix_ms), *(_text(2, _metric(metric, unix_ms, units)) for metric in metrics)]
    return b"".join([*parts, *([] if seq is None else [_number(3, seq)])])


def commands(data: bytes) -> dict[str, bool]:
    """The metrics of a command that are true or false, by name; none if it cannot be read.

    >>> commands(payload([Metric("Node Control/Rebirth", BOOLEAN, True)], 0, 0))
    {'Node Control/Rebirth': True}
    >>> commands(b"no payload")
    {}
    """
    states = {}
    try:
        for number, metric in _fields(data):
            if number == 2 and isinstance(metric, bytes):
                fields = dict(_fields(metric))
                name, value = fields.get(1), fields.get(14)
                if isinstance(name, bytes) and isinstance(value, int):
                    states[name.decode()] = bool(value)
    except (ValueError, IndexError):
        return {}
    return states


def _metric(metric: Metric, unix_ms: int, units: bool) -> bytes:
    parts = [_text(1, metric.name.encode()), _number(3, unix_ms), _number(4, metric.datatype)]
    if units and metric.unit:
        value = _number(1, STRING) + _text(8, metric.unit.encode())
        parts.append(_text(9, _text(1, b"engUnit") + _text(2, value)))
    if metric.value is None:
        return b"".join([*parts, _number(7, 1)])
    return b"".join([*parts, _value(metric.datatype, metric.value)])


def _value(datatype: int, value: Value) -> bytes:
    match datatype:
        case 8:
            return _number(11, int(value))
        case 10:
            return _varint(13 << 3 | _FIXED64) + struct.pack("<d", value)
        case 11:
            return _number(14, int(value))
        case _:
            return _text(15, str(value).encode())


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3 | _VARINT) + _varint(value)


def _text(field: int, value: bytes) -> bytes:
    return _varint(field << 3 | _BYTES) + _varint(len(value)) + value


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*encoded, value])


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and value of each field; IndexError or ValueError for what is none."""
    position = 0
    while position < len(data):
        key, position = _read_varint(data, position)
        kind = key & 7
        if kind == _VARINT:
            value, position = _read_varint(data, position)
            yield key >> 3, value
            continue
        if kind not in (_FIXED64, _BYTES, _FIXED32):
            raise ValueError("this wire type is not used")
        length = {_FIXED64: 8, _FIXED32: 4}.get(kind, 0)
        if kind == _BYTES:
            length, position = _read_varint(data, position)
        if position + length > len(data):
            raise ValueError("the field is cut")
        yield key >> 3, data[position : position + length]
        position += length


def _read_varint(data: bytes, position: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[position]
        value |= (byte & 0x7F) << shift
        position += 1
        if byte < 0x80:
            return value, position
    raise ValueError("a number of more than 64 bits")


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
            self._link.publish([message for value in values if (message := self._device(value)) is not None], qos=0)

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
    metrics = [Metric("Alarms/active", UINT64, len(values.alarms))]
    newest = max(values.alarms, key=lambda alarm: alarm.unix_s, default=None)
    metrics.append(Metric("Alarms/newest", STRING, "" if newest is None else newest.message))
    for measurement in values.measurements:
        metrics.append(Metric(f"Parameters/{measurement.name}", DOUBLE, measurement.value, measurement.unit))
        metrics.append(Metric(f"Parameters/{measurement.name} bound", DOUBLE, measurement.bound, measurement.unit))
    for name, value in values.status.items():
        datatype = STRING if isinstance(value, str) else UINT64 if name in _COUNTS else DOUBLE
        metrics.append(Metric(f"Status/{name}", datatype, value))
    return metrics


def _now_ms() -> int:
    return int(1e3 * time.time())
