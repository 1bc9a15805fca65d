"""Lines of JSON that each carry their own checksum: any tool reads them, and we know a damaged one."""

from __future__ import annotations

import json
import zlib
from typing import Any

from livebode.records.plain_json import to_json

_KEY = ', "crc32": "'


def to_line(value: dict[str, Any]) -> bytes:
    """The object on one line, with the CRC-32 of its text without that key as its last one.

    >>> to_line({"kind": "gap"})
    b'{"kind": "gap", "crc32": "edb2896b"}\\n'
    """
    text = to_json(value)
    return f'{text[:-1]}{_KEY}{_checksum(text)}"}}\n'.encode()


def from_line(line: bytes) -> dict[str, Any]:
    """The object again, without its checksum; ValueError where it is damaged. A line without a checksum is taken.

    >>> from_line(b'{"kind": "gap", "crc32": "edb2896b"}')
    {'kind': 'gap'}
    >>> from_line(b'{"kind": "gab", "crc32": "edb2896b"}')
    Traceback (most recent call last):
    ValueError: the checksum of '{"kind": "gab"}' is wrong
    """
    text, key, rest = line.decode("utf-8").rstrip("\n").rpartition(_KEY)
    if not key:
        text = rest
    else:
        text += "}"
        if rest != f'{_checksum(text)}"}}':
            raise ValueError(f"the checksum of {text[:80]!r} is wrong")
    value = json.loads(text)
    if not isinstance(value, dict):
        raise ValueError(f"{text[:80]!r} is not an object")
    return value


def whole_lines(data: bytes) -> tuple[list[dict[str, Any]], int]:
    """The objects up to the first damaged line, and the bytes that they take."""
    found, end = [], 0
    for line in data.splitlines(keepends=True):
        if not line.endswith(b"\n"):
            break
        try:
            found.append(from_line(line))
        except ValueError:
            break
        end += len(line)
    return found, end


def _checksum(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x}"
