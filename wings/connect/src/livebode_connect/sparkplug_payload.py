"""Payloads of Sparkplug B: the few messages of Protocol Buffers that livebode sends and reads.

The numbers of the fields are those of the Sparkplug specification 3.0, section 6.4. The public libraries for Python
need paho-mqtt below version 2, and the schema is not under a licence of livebode's kind; the wire format of six fields
is shorter than either.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

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
    found = {}
    try:
        for number, metric in _fields(data):
            if number == 2 and isinstance(metric, bytes):
                fields = dict(_fields(metric))
                name, value = fields.get(1), fields.get(14)
                if isinstance(name, bytes) and isinstance(value, int):
                    found[name.decode()] = bool(value)
    except (ValueError, IndexError):
        return {}
    return found


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
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*found, value])


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and value of each field; IndexError or ValueError for what is none."""
    at = 0
    while at < len(data):
        key, at = _read_varint(data, at)
        kind = key & 7
        if kind == _VARINT:
            value, at = _read_varint(data, at)
            yield key >> 3, value
            continue
        if kind not in (_FIXED64, _BYTES, _FIXED32):
            raise ValueError("this wire type is not used")
        length = {_FIXED64: 8, _FIXED32: 4}.get(kind, 0)
        if kind == _BYTES:
            length, at = _read_varint(data, at)
        if at + length > len(data):
            raise ValueError("the field is cut")
        yield key >> 3, data[at : at + length]
        at += length


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at += 1
        if byte < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")
