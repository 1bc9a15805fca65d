"""Frames: how the journal keeps pieces apart. A frame is whole or it ends the journal."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

SCHEMA, ROWS, COMMIT = 1, 2, 3
"""A table's name and Arrow schema; an Arrow record batch of it; a moment up to which the record is complete."""

_HEADER = struct.Struct("<2sBBII")
_CHECK = struct.Struct("<I")
_MAGIC = b"LB"
_SIZE = _HEADER.size + _CHECK.size


def to_frame(kind: int, *payload: bytes | memoryview, table: int = 0) -> bytes:
    """Header (magic, kind, table, length, CRC-32 of the payload, CRC-32 of the header) and payload.

    >>> [(kind, bytes(payload)) for kind, _, payload, _ in whole_frames(to_frame(COMMIT, b"a", b"b") + b"LB")]
    [(3, b'ab')]
    """
    check = 0
    for part in payload:
        check = zlib.crc32(part, check)
    header = _HEADER.pack(_MAGIC, kind, table, sum(map(len, payload)), check)
    return b"".join([header, _CHECK.pack(zlib.crc32(header)), *payload])


def whole_frames(data: bytes) -> Iterator[tuple[int, int, memoryview, int]]:
    """Kind, table, payload and end of each frame, up to the first that is damaged or cut off."""
    view, at = memoryview(data), 0
    while at + _SIZE <= len(view):
        header = view[at : at + _HEADER.size]
        magic, kind, table, length, check = _HEADER.unpack(header)
        payload = view[at + _SIZE : at + _SIZE + length]
        if magic != _MAGIC or _CHECK.unpack_from(view, at + _HEADER.size)[0] != zlib.crc32(header):
            return
        if len(payload) < length or zlib.crc32(payload) != check:
            return
        at += _SIZE + length
        yield kind, table, payload, at
