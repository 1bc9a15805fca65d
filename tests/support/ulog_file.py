"""ULog files by the format's published specification (version 1), for the tests of its reader."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

MAGIC = b"ULog\x01\x12\x35\x01"
TYPES = {"u8": "uint64_t", "f8": "double", "f4": "float", "i2": "int16_t", "u1": "uint8_t", "b1": "bool"}
Topics = Mapping[str, Mapping[str, NDArray[np.generic]]]


def message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def definition(name: str, fields: str) -> bytes:
    return message("F", f"{name}:{fields}".encode())


def subscription(name: str, number: int, instance: int = 0) -> bytes:
    return message("A", struct.pack("<BH", instance, number) + name.encode())


def sample(number: int, content: bytes) -> bytes:
    return message("D", struct.pack("<H", number) + content)


def parameter(name: str, value: float) -> bytes:
    key = f"float {name}".encode()
    return message("P", struct.pack("B", len(key)) + key + struct.pack("<f", value))


def dropout(duration_ms: int) -> bytes:
    return message("O", struct.pack("<H", duration_ms))


def assembled(definitions: Iterable[bytes], data: Iterable[bytes]) -> bytes:
    """A file with a flag message, these definitions and this data."""
    return MAGIC + struct.pack("<Q", 0) + message("B", bytes(40)) + b"".join(definitions) + b"".join(data)


def ulog_file(topics: Topics) -> bytes:
    """Topics by name, or name[instance]; the messages of all topics follow in the order of their timestamps."""
    definitions: dict[str, bytes] = {}
    subscriptions, samples = [], []
    for number, (title, fields) in enumerate(topics.items()):
        name, _, instance = title.rstrip("]").partition("[")
        kinds = "".join(f"{TYPES[values.dtype.str[1:]]} {field};" for field, values in fields.items())
        definitions[name] = definition(name, kinds)
        subscriptions.append(subscription(name, number, int(instance or 0)))
        rows = zip(*(values.astype(values.dtype.newbyteorder("<")) for values in fields.values()), strict=True)
        samples += [(int(row[0]), sample(number, b"".join(value.tobytes() for value in row))) for row in rows]
    ordered = (
        [content for _, content in sorted(samples, key=lambda one: one[0])]
        if len(topics) > 1
        else [content for _, content in samples]
    )
    return assembled(definitions.values(), [*subscriptions, *ordered])
