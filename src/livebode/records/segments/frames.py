"""Frames: they separate the pieces of the journal, and allow to find the next intact piece after a damaged one."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

from livebode.dataclass import dataclass

FORMAT, ROWS, COMMIT, TABLE = 1, 2, 3, 4
"""Kinds: the format and its version; an Arrow record batch of a table; a commit; a table's name and Arrow schema."""

_HEADER = struct.Struct("<2sBBII")
_CHECK = struct.Struct("<I")
_MAGIC = b"LB"
_SIZE = _HEADER.size + _CHECK.size


@dataclass(frozen=True)
class Frame:
    """A piece of the journal from byte `start` to `end`; `payload` is None if these bytes are damaged."""

    kind: int
    table: int
    payload: memoryview | None
    start: int
    end: int


def to_frame(kind: int, *payload: bytes | memoryview, table: int = 0) -> bytes:
    """Header (magic, kind, table, length, CRC-32 of the payload, CRC-32 of the header) and payload.

    >>> [(frame.kind, bytes(frame.payload)) for frame in frames(to_frame(COMMIT, b"a", b"b") + b"LB")]
    [(3, b'ab')]
    """
    check = 0
    for part in payload:
        check = zlib.crc32(part, check)
    header = _HEADER.pack(_MAGIC, kind, table, sum(map(len, payload)), check)
    return b"".join([header, _CHECK.pack(zlib.crc32(header)), *payload])


def frames(data: bytes) -> Iterator[Frame]:
    """Each frame, and a Frame without payload for each damaged piece, up to the end or a torn frame.

    A frame whose writing was interrupted is torn: only its beginning exists, at the very end. Anything else is damaged.
    """
    view, position = memoryview(data), 0
    while position < len(view):
        kind, table, length, check = _header(view, position) or (0, 0, 0, 0)
        end = position + _SIZE + length
        if not kind:
            end = _next_header(data, position + 1)
            if end == len(view) and _may_be_torn(view[position:]):
                return
            yield Frame(0, 0, None, position, end)
        elif end > len(view):
            return
        else:
            payload = view[position + _SIZE : end]
            yield Frame(kind, table, payload if zlib.crc32(payload) == check else None, position, end)
        position = end


def _header(view: memoryview, position: int) -> tuple[int, int, int, int] | None:
    """Kind, table, length and checksum of the frame that begins here; None without an intact header."""
    if position + _SIZE > len(view):
        return None
    header = view[position : position + _HEADER.size]
    magic, kind, table, length, check = _HEADER.unpack(header)
    if magic != _MAGIC or not kind or _CHECK.unpack_from(view, position + _HEADER.size)[0] != zlib.crc32(header):
        return None
    return kind, table, length, check


def _next_header(data: bytes, position: int) -> int:
    view = memoryview(data)
    while (position := data.find(_MAGIC, position)) >= 0:
        if _header(view, position):
            return position
        position += 1
    return len(data)


def _may_be_torn(remainder: memoryview) -> bool:
    return len(remainder) < _SIZE and bytes(remainder[: len(_MAGIC)]) == _MAGIC[: len(remainder)]
