"""FlatBuffers, in which the metadata of Arrow IPC are written: tables of numbered fields, read and written.

https://flatbuffers.dev/internals. Reading raises struct.error or ValueError on damaged bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence


def root(data: bytes) -> int:
    """Position of the first table."""
    return int(struct.unpack_from("<I", data)[0])


def field(data: bytes, table: int, number: int) -> int | None:
    """Position of a field of a table; None if it is absent."""
    layout = table - struct.unpack_from("<i", data, table)[0]
    entry = 4 + 2 * number
    if entry >= struct.unpack_from("<H", data, layout)[0]:
        return None
    offset = struct.unpack_from("<H", data, layout + entry)[0]
    return table + offset if offset else None


def number_at(code: str, data: bytes, table: int, number: int) -> int:
    """The value of a field, of this code of `struct`; 0 if it is absent."""
    place = field(data, table, number)
    return 0 if place is None else int(struct.unpack_from("<" + code, data, place)[0])


def referred(data: bytes, table: int, number: int) -> int | None:
    """Position to which a field refers; None if it is absent."""
    place = field(data, table, number)
    return None if place is None else place + int(struct.unpack_from("<I", data, place)[0])


def text(data: bytes, table: int, number: int) -> str:
    """The text of a field; "" if it is absent."""
    place = referred(data, table, number)
    if place is None:
        return ""
    (size,) = struct.unpack_from("<I", data, place)
    if place + 4 + size > len(data):
        raise ValueError("a text is cut")
    return data[place + 4 : place + 4 + size].decode("utf-8", "replace")


def tables(data: bytes, table: int, number: int) -> list[int]:
    """Positions of the tables in a vector."""
    place = referred(data, table, number)
    if place is None:
        return []
    (count,) = struct.unpack_from("<I", data, place)
    if place + 4 + 4 * count > len(data):
        raise ValueError("a vector is cut")
    at = range(place + 4, place + 4 + 4 * count, 4)
    return [here + int(struct.unpack_from("<I", data, here)[0]) for here in at]


class FlatBuffer:
    """Bytes of tables: one that is referred to comes after the one that refers to it."""

    def __init__(self) -> None:
        self.data = bytearray(4)

    def table(self, *fields: tuple[str, int] | None) -> tuple[int, list[int]]:
        """Append a table of these codes of `struct` and values, by number; its position, and those of its fields."""
        layout = struct.calcsize("<i")
        offsets = []
        for one in fields:
            size = 0 if one is None else struct.calcsize("<" + one[0])
            layout += -layout % size if size else 0
            offsets.append(layout if size else 0)
            layout += size
        head = 4 + 2 * len(fields)
        self.data += bytes(-(len(self.data) + head) % 4)
        self.data += struct.pack(f"<HH{len(fields)}H", head, layout, *offsets)
        begin = len(self.data)
        self.data += struct.pack("<i", head) + bytes(layout - 4)
        for one, offset in zip(fields, offsets):
            if one is not None:
                struct.pack_into("<" + one[0], self.data, begin + offset, one[1])
        return begin, [begin + offset for offset in offsets]

    def refer(self, place: int, target: int) -> None:
        """Let the field at `place` refer to `target`."""
        struct.pack_into("<I", self.data, place, target - place)

    def text(self, place: int, value: str) -> None:
        """Append a text, to which the field at `place` refers."""
        letters = value.encode()
        self.refer(place, self._aligned())
        self.data += struct.pack("<I", len(letters)) + letters + b"\0"

    def vector(self, place: int, count: int) -> Sequence[int]:
        """Append a vector, to which the field at `place` refers; the positions of its references."""
        begin = self._aligned()
        self.refer(place, begin)
        self.data += struct.pack("<I", count) + bytes(4 * count)
        return range(begin + 4, begin + 4 + 4 * count, 4)

    def _aligned(self) -> int:
        self.data += bytes(-len(self.data) % 4)
        return len(self.data)
