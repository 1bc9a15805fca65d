"""Thrift's compact protocol, in which the footer of a Parquet file is written: any struct, without its names."""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET, MAP, STRUCT = range(1, 13)
_INTEGERS = I16, I32, I64
_DEPTH_MAX = 32


class Value(NamedTuple):
    """A value with its type; that of a list is (type of its items, items), items without a type of their own."""

    type: int
    value: Any


Struct = dict[int, Value]
"""The fields of a struct by their numbers. In what is written a struct may also be its bytes."""


def decode(data: bytes) -> Struct:
    """The struct with which these bytes begin.

    Raises
    ------
    ValueError
        If there is none.
    """
    try:
        return _Reader(data).struct(0)
    except IndexError:
        raise ValueError("the bytes end within a struct") from None


def encode(fields: Struct) -> bytes:
    """The bytes of a struct.

    >>> decode(encode({1: Value(I32, -5), 4: Value(LIST, (BINARY, [b"a"]))}))
    {1: Value(type=5, value=-5), 4: Value(type=9, value=(8, [b'a']))}
    """
    out = bytearray()
    last = 0
    for number in sorted(fields):
        kind, value = fields[number]
        step = number - last
        if 0 < step < 16:
            out.append(step << 4 | kind)
        else:
            out.append(kind)
            out += _varint(_zigzag(number))
        if kind not in (TRUE, FALSE):
            out += _encoded(kind, value)
        last = number
    out.append(0)
    return bytes(out)


def _encoded(kind: int, value: Any) -> bytes:
    if kind in _INTEGERS:
        return _varint(_zigzag(value))
    if kind == BINARY:
        return _varint(len(value)) + bytes(value)
    if kind == STRUCT:
        return value if isinstance(value, bytes) else encode(value)
    if kind in (LIST, SET):
        of, items = value
        head = bytes([len(items) << 4 | of]) if len(items) < 15 else bytes([0xF0 | of]) + _varint(len(items))
        return head + b"".join(_encoded(of, item) for item in items)
    if kind == DOUBLE:
        return struct.pack("<d", value)
    if kind in (TRUE, FALSE, BYTE):  # truth values of a list are bytes, too
        return bytes([value & 0xFF])
    raise ValueError(f"Thrift's type {kind} is not supported")


def _zigzag(number: int) -> int:
    return number << 1 if number >= 0 else (-number << 1) - 1


def _varint(number: int) -> bytes:
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


class _Reader:
    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def struct(self, depth: int) -> Struct:
        if depth > _DEPTH_MAX:
            raise ValueError("the structs are nested too deeply")
        fields: Struct = {}
        number = 0
        while head := self._byte():
            kind = head & 0x0F
            number = number + (head >> 4) if head >> 4 else self._integer()
            fields[number] = Value(kind, kind == TRUE if kind in (TRUE, FALSE) else self._value(kind, depth))
        return fields

    def _value(self, kind: int, depth: int) -> Any:
        if kind in _INTEGERS:
            return self._integer()
        if kind == BINARY:
            return self._bytes(self._varint())
        if kind == STRUCT:
            return self.struct(depth + 1)
        if kind in (LIST, SET):
            head = self._byte()
            count = head >> 4 if head >> 4 < 15 else self._varint()
            if count > len(self._data):
                raise ValueError("a list is longer than the bytes")
            return head & 0x0F, [self._value(head & 0x0F, depth + 1) for _ in range(count)]
        if kind == DOUBLE:
            return struct.unpack("<d", self._bytes(8))[0]
        if kind in (TRUE, FALSE, BYTE):
            return self._byte()
        raise ValueError(f"Thrift's type {kind} is not supported")

    def _integer(self) -> int:
        number = self._varint()
        return number >> 1 if number & 1 == 0 else -(number + 1 >> 1)

    def _varint(self) -> int:
        number = shift = 0
        while (byte := self._byte()) & 0x80:
            number |= (byte & 0x7F) << shift
            shift += 7
            if shift > 63:
                raise ValueError("an integer is too long")
        return number | byte << shift

    def _byte(self) -> int:
        self._at += 1
        return self._data[self._at - 1]

    def _bytes(self, count: int) -> bytes:
        found = self._data[self._at : self._at + count]
        if len(found) < count:
            raise ValueError("the bytes end within a struct")
        self._at += count
        return found
