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


def decode(data: bytes | memoryview, at: int = 0) -> tuple[Struct, int]:
    """The struct that begins at this byte, and the byte after it.

    Memory and time are at most proportional to the bytes, whatever these declare.

    Raises
    ------
    ValueError
        If there is none.
    """
    try:
        return _struct(data, at, 0)
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
    found = bytearray()
    before = 0
    for number, kind, value in fields:
        found.append((number - before) << 4 | kind)
        found += value
        before = number
    found.append(0)
    return bytes(found)


def _struct(data: bytes | memoryview, at: int, depth: int) -> tuple[Struct, int]:
    """A footer has thousands of fields: most integers are read without a call."""
    if depth > _DEPTH_MAX:
        raise ValueError("values are nested too deeply")
    found: Struct = {}
    number = 0
    while head := data[at]:
        at += 1
        kind = head & 15
        if head > 15:
            number += head >> 4
        else:
            number, at = _integer(data, at)
        if kind == I32 or kind == I64:  # noqa: SIM109 (faster)
            value = data[at]
            at += 1
            if value > 127:
                value, at = _long(data, at, value)
            found[number << 4 | kind] = value >> 1 ^ -(value & 1)
        elif kind == BINARY and (size := data[at]) < 0x80 and (end := at + 1 + size) <= len(data):
            found[number << 4 | kind] = bytes(data[at + 1 : end])
            at = end
        elif kind == STRUCT:
            found[number << 4 | kind], at = _struct(data, at, depth + 1)
        elif kind <= FALSE:
            found[number << 4 | kind] = True
        else:
            found[number << 4 | kind], at = _value(data, at, kind, depth)
    return found, at + 1


def _value(data: bytes | memoryview, at: int, kind: int, depth: int) -> tuple[Any, int]:
    if kind == BINARY:
        size, at = _unsigned(data, at)
        return _bytes(data, at, size), at + size
    if kind == STRUCT:
        return _struct(data, at, depth + 1)
    if kind in (LIST, SET):
        return _list(data, at, depth + 1)
    if kind == DOUBLE:
        return _bytes(data, at, 8), at + 8
    if kind in (TRUE, FALSE, BYTE):  # in a list a truth value has a byte of its own
        return data[at], at + 1
    if kind in (I16, I32, I64):
        return _integer(data, at)
    raise ValueError(f"there is no type {kind}")


def _list(data: bytes | memoryview, at: int, depth: int) -> tuple[list[Any], int]:
    if depth > _DEPTH_MAX:
        raise ValueError("values are nested too deeply")
    head = data[at]
    count, at = (head >> 4, at + 1) if head < 0xF0 else _unsigned(data, at + 1)
    if count > len(data) - at:
        raise ValueError("a list is longer than the bytes")
    found = []
    kind = head & 15
    for _ in range(count):
        value, at = _struct(data, at, depth) if kind == STRUCT else _value(data, at, kind, depth)
        found.append(value)
    return found, at


def _bytes(data: bytes | memoryview, at: int, size: int) -> bytes:
    if size > len(data) - at:
        raise ValueError("it ends early")
    return bytes(data[at : at + size])


def _integer(data: bytes | memoryview, at: int) -> tuple[int, int]:
    value, at = _unsigned(data, at)
    return value >> 1 ^ -(value & 1), at


def _unsigned(data: bytes | memoryview, at: int) -> tuple[int, int]:
    value = data[at]
    return (value, at + 1) if value < 0x80 else _long(data, at + 1, value)


def _long(data: bytes | memoryview, at: int, value: int) -> tuple[int, int]:
    """A number whose first byte is `value`."""
    value &= 0x7F
    for shift in range(7, 70, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("a number has more than ten bytes")


def unsigned(value: int) -> bytes:
    """A written integer that is not negative, without a sign."""
    if value < 0x80:
        return bytes((value,))
    found = bytearray()
    while value >= 0x80:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)
