"""Thrift's compact protocol, in which the footer and the page headers of a Parquet file are written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET, _MAP, STRUCT = range(1, 13)
"""Types of values."""
Struct = dict[int, Any]
"""The fields of a struct by `field(number, type)`: integers, bytes, lists of these, or structs; a double is its bytes.

A field of another type than a reader expects is so a field that is absent."""
_SMALL = [bytes((2 * value,)) for value in range(64)]
_DEPTH_MAX = 16  # Parquet's own structs need seven


def field(number: int, kind: int) -> int:
    """The key of a field in a Struct."""
    return number << 4 | kind


def decode(data: bytes | memoryview, position: int = 0) -> tuple[Struct, int]:
    """The struct that begins at this byte, and the byte after it.

    Memory and time are at most proportional to the bytes, whatever these declare.

    Raises
    ------
    ValueError
        If there is none.
    """
    try:
        return _struct(data, position, 0)
    except IndexError:
        raise ValueError("it ends early") from None


def integer(value: int) -> bytes:
    """A written integer."""
    if 0 <= value < 64:
        return _SMALL[value]
    return unsigned(value << 1 if value >= 0 else ~value << 1 | 1)


def binary(data: bytes) -> bytes:
    """Written bytes."""
    return unsigned(len(data)) + data


def list_of(kind: int, items: Sequence[bytes]) -> bytes:
    """A list of written values of this type."""
    head = bytes([len(items) << 4 | kind]) if len(items) < 15 else bytes([0xF0 | kind]) + unsigned(len(items))
    return head + b"".join(items)


def struct_of(*fields: tuple[int, int, bytes]) -> bytes:
    """A struct of fields with their numbers, which are less than 16 and ascend, their types, and written values.

    >>> decode(struct_of((1, I32, integer(-5)), (4, LIST, list_of(BINARY, [binary(b"a")]))))[0]
    {21: -5, 73: [b'a']}
    """
    encoded = bytearray()
    before = 0
    for number, kind, value in fields:
        encoded.append((number - before) << 4 | kind)
        encoded += value
        before = number
    encoded.append(0)
    return bytes(encoded)


def _struct(data: bytes | memoryview, position: int, depth: int) -> tuple[Struct, int]:
    """A footer has thousands of fields: most integers are read without a call."""
    if depth > _DEPTH_MAX:
        raise ValueError("values are nested too deeply")
    fields: Struct = {}
    number = 0
    while head := data[position]:
        position += 1
        kind = head & 15
        if head > 15:
            number += head >> 4
        else:
            number, position = _integer(data, position)
        if kind == I32 or kind == I64:  # noqa: SIM109 (faster)
            value = data[position]
            position += 1
            if value > 127:
                value, position = _long(data, position, value)
            fields[number << 4 | kind] = value >> 1 ^ -(value & 1)
        elif kind == BINARY and (size := data[position]) < 0x80 and (end := position + 1 + size) <= len(data):
            fields[number << 4 | kind] = bytes(data[position + 1 : end])
            position = end
        elif kind == STRUCT:
            fields[number << 4 | kind], position = _struct(data, position, depth + 1)
        elif kind <= FALSE:
            fields[number << 4 | kind] = True
        else:
            fields[number << 4 | kind], position = _value(data, position, kind, depth)
    return fields, position + 1


def _value(data: bytes | memoryview, position: int, kind: int, depth: int) -> tuple[Any, int]:
    if kind == BINARY:
        size, position = _unsigned(data, position)
        return _bytes(data, position, size), position + size
    if kind == STRUCT:
        return _struct(data, position, depth + 1)
    if kind in (LIST, SET):
        return _list(data, position, depth + 1)
    if kind == DOUBLE:
        return _bytes(data, position, 8), position + 8
    if kind in (TRUE, FALSE, BYTE):  # in a list a truth value has a byte of its own
        return data[position], position + 1
    if kind in (I16, I32, I64):
        return _integer(data, position)
    raise ValueError(f"there is no type {kind}")


def _list(data: bytes | memoryview, position: int, depth: int) -> tuple[list[Any], int]:
    if depth > _DEPTH_MAX:
        raise ValueError("values are nested too deeply")
    head = data[position]
    count, position = (head >> 4, position + 1) if head < 0xF0 else _unsigned(data, position + 1)
    if count > len(data) - position:
        raise ValueError("a list is longer than the bytes")
    values = []
    kind = head & 15
    for _ in range(count):
        value, position = _struct(data, position, depth) if kind == STRUCT else _value(data, position, kind, depth)
        values.append(value)
    return values, position


def _bytes(data: bytes | memoryview, position: int, size: int) -> bytes:
    if size > len(data) - position:
        raise ValueError("it ends early")
    return bytes(data[position : position + size])


def _integer(data: bytes | memoryview, position: int) -> tuple[int, int]:
    value, position = _unsigned(data, position)
    return value >> 1 ^ -(value & 1), position


def _unsigned(data: bytes | memoryview, position: int) -> tuple[int, int]:
    value = data[position]
    return (value, position + 1) if value < 0x80 else _long(data, position + 1, value)


def _long(data: bytes | memoryview, position: int, value: int) -> tuple[int, int]:
    """A number whose first byte is `value`."""
    value &= 0x7F
    for shift in range(7, 70, 7):
        byte = data[position]
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, position
    raise ValueError("a number has more than ten bytes")


def unsigned(value: int) -> bytes:
    """A written integer that is not negative, without a sign."""
    if value < 0x80:
        return bytes((value,))
    encoded = bytearray()
    while value >= 0x80:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)
