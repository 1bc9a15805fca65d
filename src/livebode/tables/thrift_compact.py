"""Thrift's compact protocol, as far as Parquet's footers and page headers use it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET, _MAP, STRUCT = range(1, 13)
"""Types of values."""
_SIZES = {TRUE: 0, FALSE: 0, BYTE: 1, DOUBLE: 8}  # in a struct; Parquet has no maps
_DEPTH_MAX = 16  # Parquet's own structs need seven


class CompactReader:
    """Values one after the other; memory and time are at most proportional to the bytes, whatever these declare.

    Every method raises ValueError if the bytes end early or are not of this protocol.
    """

    def __init__(self, data: bytes | memoryview, at: int = 0) -> None:
        self.data, self.at = data, at

    def fields(self) -> Iterator[tuple[int, int]]:
        """Number and type of each field of a struct. The caller reads or skips the value before the next one."""
        number = 0
        while head := self._byte():
            step = head >> 4
            number = number + step if step else self.integer()
            yield number, head & 15

    def integer(self) -> int:
        value = self._varint()
        return value >> 1 ^ -(value & 1)

    def binary(self) -> bytes:
        return bytes(self._next(self._varint()))

    def items(self, kind: int) -> range:
        """The numbers of the values of a list of this type; the caller reads each."""
        count, found = self._list_head()
        if found != kind and count:
            raise ValueError(f"a list has values of type {found} in place of {kind}")
        return range(count)

    def skip(self, kind: int, depth: int = 0) -> None:
        """Skip a value."""
        if depth > _DEPTH_MAX:
            raise ValueError("values are nested too deeply")
        if kind in (I16, I32, I64):
            self._varint()
        elif kind in _SIZES:
            self._next(_SIZES[kind])
        elif kind == BINARY:
            self._next(self._varint())
        elif kind == STRUCT:
            for _, inner in self.fields():
                self.skip(inner, depth + 1)
        elif kind in (LIST, SET):
            count, inner = self._list_head()
            for _ in range(count):
                self._skip_item(inner, depth)
        else:
            raise ValueError(f"there is no type {kind}")

    def _skip_item(self, kind: int, depth: int) -> None:
        """In a list a truth value has a byte of its own, so that each value has one at least."""
        self.skip(BYTE if kind in (TRUE, FALSE) else kind, depth + 1)

    def _list_head(self) -> tuple[int, int]:
        head = self._byte()
        return head >> 4 if head < 0xF0 else self._varint(), head & 15

    def _varint(self) -> int:
        value = self._byte()
        if value < 0x80:
            return value
        value &= 0x7F
        for shift in range(7, 70, 7):
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise ValueError("a number has more than ten bytes")

    def _byte(self) -> int:
        at = self.at
        self.at = at + 1
        try:
            return self.data[at]
        except IndexError:
            raise ValueError("it ends early") from None

    def _next(self, size: int) -> bytes | memoryview:
        at = self.at
        if size > len(self.data) - at:
            raise ValueError("it ends early")
        self.at = at + size
        return self.data[at : self.at]


def integer(value: int) -> bytes:
    """Inverse of `CompactReader.integer`."""
    return _varint(value << 1 if value >= 0 else ~value << 1 | 1)


def binary(data: bytes) -> bytes:
    """Inverse of `CompactReader.binary`."""
    return _varint(len(data)) + data


def list_of(kind: int, items: Sequence[bytes]) -> bytes:
    """A list of written values of this type."""
    head = bytes([len(items) << 4 | kind]) if len(items) < 15 else bytes([0xF0 | kind]) + _varint(len(items))
    return head + b"".join(items)


def struct_of(*fields: tuple[int, int, bytes]) -> bytes:
    """A struct of fields with their numbers, which are less than 16 and ascend, their types, and written values."""
    numbers = [0, *(number for number, _, _ in fields)]
    heads = (bytes([number - before << 4 | kind]) for before, (number, kind, _) in zip(numbers, fields))
    return b"".join(head + value for head, (_, _, value) in zip(heads, fields)) + b"\0"


def _varint(value: int) -> bytes:
    found = bytearray()
    while value >= 0x80:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*found, value])
