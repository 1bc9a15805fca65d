"""Lines of JSON, each with its own checksum: any tool can read them, and damaged ones are detected."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator
from typing import Any

from livebode.records.json_format import to_json

EVENTS = "events.jsonl"
"""The events of a run, one on each line."""
_KEY = ', "crc32": "'
_END = re.compile(rb', "crc32": "[0-9a-f]{8}"\}')


def to_line(value: dict[str, Any]) -> bytes:
    """The object on one line; its last key is the CRC-32 of the text without that key.

    >>> to_line({"kind": "gap"})
    b'{"kind": "gap", "crc32": "edb2896b"}\\n'
    """
    text = to_json(value)
    return f'{text[:-1]}{_KEY}{_checksum(text)}"}}\n'.encode()


def from_line(line: bytes) -> dict[str, Any]:
    """The object without its checksum; ValueError if it is damaged or has no checksum.

    >>> from_line(b'{"kind": "gap", "crc32": "edb2896b"}')
    {'kind': 'gap'}
    >>> from_line(b'{"kind": "gab", "crc32": "edb2896b"}')
    Traceback (most recent call last):
    ValueError: the checksum of '{"kind": "gab"}' is wrong
    """
    text, _, checksum = line.decode("utf-8").rstrip("\n").rpartition(_KEY)
    text += "}"
    if checksum != f'{_checksum(text)}"}}':
        raise ValueError(f"the checksum of {text[:80]!r} is wrong")
    try:
        value = json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    if not isinstance(value, dict):
        raise ValueError(f"{text[:80]!r} is not an object")
    return value


def in_line(line: bytes) -> Iterator[dict[str, Any] | bytes]:
    """Content of a line: one object; for a damaged line the intact objects, and the damaged bytes between them.

    Two objects share a line if the line end between them is damaged.

    >>> list(in_line(b'{"kind": "gap", "crc32": "edb2896b"}*{"kind": "gap", "crc32": "edb2896b"}'))
    [{'kind': 'gap'}, b'*', {'kind': 'gap'}]
    """
    try:
        yield from_line(line)
        return
    except ValueError:
        remainder, position = line.rstrip(b"\n"), 0
    for end in dict.fromkeys([*(match.end() for match in _END.finditer(remainder)), len(remainder)]):
        yield from _pieces(remainder[position:end])
        position = end


def _pieces(piece: bytes) -> Iterator[dict[str, Any] | bytes]:
    for skipped in (0, 1):  # 1: after a damaged line end
        try:
            value = from_line(piece[skipped:])
        except ValueError:
            continue
        if skipped:
            yield piece[:skipped]
        yield value
        return
    yield piece


def _checksum(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x}"
