"""List and check a MATLAB v5 file before SciPy reads it: complete elements, and no sizes larger than its bytes.

SciPy trusts the sizes that a file declares; a damaged one can make it ask for terabytes or read past the end. Each
element is a tag (type, bytes) and its bytes; matrices nest. Compressed elements are unpacked piece by piece.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from livebode.core import RecordingError
from livebode.dataclass import dataclass
from livebode.sources.recording import damaged, oversized, truncated

HEADER_BYTES = 128
COMPRESSED, MATRIX = 15, 14
CLASSES = {
    1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 6: "double", 7: "single", 8: "int8", 9: "uint8",
    10: "int16", 11: "uint16", 12: "int32", 13: "uint32", 14: "int64", 15: "uint64", 16: "function", 17: "opaque",
}  # fmt: skip
CELL, STRUCT, OBJECT, FUNCTION, OPAQUE = 1, 2, 3, 16, 17
COMPLEX = 0x0800
FLAGS, DIMENSIONS, TEXT = frozenset({6}), frozenset({5}), frozenset({1, 16})
VALUES = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18})
"""Types of elements: integers of 8 to 32 bits, single, double, 64 bits, UTF-8, UTF-16, UTF-32."""
DIMENSIONS_MAX = 32
DEPTH_MAX = 32
ELEMENTS_MAX = 1_000_000
UNPACKED_MAX = 1 << 34


@dataclass(frozen=True)
class Variable:
    """Header of a variable: MATLAB's name of its class, its dimensions, and whether it has an imaginary part.

    `byte` is where its element begins in the file, and `order` the order of the bytes there.
    """

    name: str
    kind: str
    shape: tuple[int, ...] = ()
    is_complex: bool = False
    byte: int = 0
    order: str = "<"


def list_variables(path: Path) -> list[Variable]:
    """All variables of the file, in its order, after a check of everything in them.

    Raises
    ------
    RecordingError
        If an element ends after its container, or declares more values than it has bytes.
    """
    size = path.stat().st_size
    found: list[Variable] = []
    with path.open("rb") as file:
        header = file.read(HEADER_BYTES)
        if len(header) < HEADER_BYTES or header[126:128] not in (b"IM", b"MI"):
            raise damaged(f"the MATLAB header of {path} is damaged", path=str(path))
        order = "<" if header[126:128] == b"IM" else ">"
        at = HEADER_BYTES
        while at < size:
            variable, after = check_top(path, file, at, size, order)
            found.append(replace(variable, byte=at, order=order))
            at = after
    return [variable for variable in found if variable.name]  # MATLAB stores its own workspace without a name


def check_top(path: Path, file: BinaryIO, at: int, size: int, order: str) -> tuple[Variable, int]:
    """Check the element at byte `at` of the file; its head, and the byte after it."""
    file.seek(at)
    tag = file.read(8)
    if len(tag) < 8:
        raise truncated(f"{path} ends in the middle of a tag at byte {at}", path=str(path), byte=at)
    kind, length = struct.unpack(order + "II", tag)
    if at + 8 + length > size:
        raise truncated(
            f"{path} ends at byte {size}, but the element at byte {at} has {length} bytes",
            path=str(path),
            byte=at,
            declared_bytes=length,
        )
    source: Plain | Unpacked = Plain(file)
    inner = length
    if kind == COMPRESSED:
        source = Unpacked(file, length)
        kind, inner = MatlabWalk(source, order).tag(UNPACKED_MAX)
    if kind != MATRIX:
        raise damaged(
            f"{path} has an element of type {kind} at byte {at}, which is not a variable", path=str(path), byte=at
        )
    variable = MatlabWalk(source, order).matrix(inner, 0)
    source.rest()
    return variable, at + 8 + length


class Plain:
    """Bytes of the file itself."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, count: int) -> bytes:
        return self._file.read(count)

    def skip(self, count: int) -> None:
        self._file.seek(count, 1)

    def rest(self) -> None:
        """Nothing to do: no checksum follows."""


class Unpacked:
    """Bytes of a compressed element, unpacked in pieces of at most a mebibyte."""

    PIECE = 1 << 20

    def __init__(self, file: BinaryIO, length: int) -> None:
        self._file, self._left = file, length
        self._zlib = zlib.decompressobj()
        self._ready = b""

    def read(self, count: int) -> bytes:
        while len(self._ready) < count and self._more():
            pass
        out, self._ready = self._ready[:count], self._ready[count:]
        return out

    def skip(self, count: int) -> None:
        while count > 0:
            got = len(self.read(min(count, self.PIECE)))
            if got == 0:
                raise truncated(f"a compressed variable ends {count} bytes early", missing_bytes=count)
            count -= got

    def rest(self) -> None:
        """Unpack to the end, where zlib compares the checksum with the bytes."""
        while self._more():
            self._ready = b""
        if not self._zlib.eof:
            raise truncated("a compressed variable has no end")

    def _more(self) -> bool:
        if self._zlib.eof:
            return False
        packed = self._zlib.unconsumed_tail
        if not packed and self._left > 0:
            packed = self._file.read(min(self._left, 1 << 16))
            self._left -= len(packed)
        piece = self._zlib.decompress(packed, self.PIECE) if packed else b""
        self._ready += piece
        return bool(piece) or bool(self._zlib.unconsumed_tail) or self._left > 0


def too_short(declared: int, left: int) -> RecordingError:
    return truncated(
        f"a variable declares {declared} bytes where {left} are left", declared_bytes=declared, left_bytes=left
    )


@dataclass
class MatlabWalk:
    """A walk through the matrices of one variable."""

    source: Plain | Unpacked
    order: str
    elements: int = 0

    def tag(self, room: int) -> tuple[int, int]:
        """Type and length of the next element, which must fit in `room` bytes; its bytes come next."""
        raw = self.source.read(8)
        if len(raw) < 8 or room < 8:
            raise truncated("a variable ends in the middle of a tag")
        kind, length = struct.unpack(self.order + "II", raw)
        if length > room - 8:
            raise too_short(length, room - 8)
        return kind, length

    def element(self, room: int, keep: int, types: frozenset[int]) -> tuple[bytes, int, int]:
        """Read one element: its first `keep` bytes, its length, and the room that is left after it.

        Its type must be among `types`: SciPy looks types up in a table without checking that they are in it. Up to
        four bytes may be inside the tag itself; a type above 65535 marks this.
        """
        raw = self.source.read(8)
        if len(raw) < 8 or room < 8:
            raise truncated("a variable ends in the middle of a tag")
        kind, length = struct.unpack(self.order + "II", raw)
        inside = kind >> 16
        if inside:
            kind, length = kind & 0xFFFF, inside
        if kind not in types:
            raise damaged(f"a variable contains an element of type {kind} where it is not allowed", element=kind)
        if length > (4 if inside else room - 8):
            raise too_short(length, room - 8)
        if inside:
            return raw[4 : 4 + length], length, room - 8
        padded = min(length + -length % 8, room - 8)
        data = self.source.read(min(length, keep))
        self.source.skip(padded - len(data))
        return data, length, room - 8 - padded

    def matrix(self, room: int, depth: int) -> Variable:
        """Check a matrix of `room` bytes, and those inside it; its head."""
        self.elements += 1
        if depth > DEPTH_MAX or self.elements > ELEMENTS_MAX:
            raise oversized(
                f"the file is nested deeper than {DEPTH_MAX} levels or has more than {ELEMENTS_MAX} elements",
                ELEMENTS_MAX,
            )
        if room == 0:
            return Variable("", "double", (0, 0))
        raw, _, room = self.element(room, 8, FLAGS)
        if len(raw) < 8:
            raise damaged("a variable has no flags")
        flags = struct.unpack(self.order + "I", raw[:4])[0]
        kind = flags & 0xFF
        if kind not in CLASSES:
            raise damaged(f"a variable has the class {kind}, which MATLAB does not have")
        if kind == OPAQUE:
            return Variable(self._opaque(room, depth), CLASSES[kind])
        raw, _, room = self.element(room, 4 * DIMENSIONS_MAX + 4, DIMENSIONS)
        shape = struct.unpack(f"{self.order}{len(raw) // 4}i", raw[: len(raw) // 4 * 4])
        if not 2 <= len(shape) <= DIMENSIONS_MAX or any(length < 0 for length in shape):
            raise damaged(f"a variable declares the dimensions {shape[:4]}…", shape=list(shape[:4]))
        name, _, room = self.element(room, 64, TEXT)
        if kind in (CELL, STRUCT, OBJECT):
            self._nested(kind, math.prod(shape), room, depth)
        elif kind == FUNCTION:
            self._inner(room, depth)
        else:
            self._values(math.prod(shape) if CLASSES[kind] != "sparse" else 0, room)
        return Variable(name.decode("latin-1"), CLASSES[kind], shape, bool(flags & COMPLEX))

    def _opaque(self, room: int, depth: int) -> str:
        """An object that only MATLAB can read: its name, two more texts and a matrix."""
        texts = []
        for _ in range(3):
            text, _, room = self.element(room, 64, TEXT)
            texts.append(text)
        self._inner(room, depth)
        return texts[0].decode("latin-1")

    def _inner(self, room: int, depth: int) -> int:
        """Check a matrix inside another; the room that is left after it."""
        inner, length = self.tag(room)
        if inner != MATRIX:
            raise damaged(f"a variable contains an element of type {inner} in place of a matrix", element=inner)
        self.matrix(length, depth + 1)
        return room - 8 - length

    def _values(self, count: int, room: int) -> None:
        """Real and imaginary part of a matrix of `count` values, at least one byte each."""
        if count > room:
            raise truncated(f"a variable declares {count} values where {room} bytes are left", declared=count)
        while room >= 8:
            _, _, room = self.element(room, 0, VALUES)
        self.source.skip(room)

    def _nested(self, kind: int, count: int, room: int, depth: int) -> None:
        if kind == OBJECT:
            _, _, room = self.element(room, 64, TEXT)  # the class name
        fields = 1
        if kind != CELL:
            raw, _, room = self.element(room, 4, DIMENSIONS)
            width = struct.unpack(self.order + "i", raw)[0] if len(raw) == 4 else 0
            if width <= 0:
                raise damaged(f"a struct declares field names of {width} bytes")
            _, length, room = self.element(room, 0, TEXT)
            fields = length // width
        if count * fields * 8 > room:
            raise truncated(
                f"a struct or cell declares {count} × {fields} parts where {room} bytes are left",
                declared=count * fields,
            )
        for _ in range(count * fields):
            room = self._inner(room, depth)
        self.source.skip(max(0, room))
