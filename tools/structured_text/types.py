"""Types of the subset, strict: integers never wrap, arrays are held to their bounds, nothing converts by itself."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import prod


class RefusedError(Exception):
    """The text steps out of the subset, or does at run time what controllers do differently or not at all."""


@dataclass(frozen=True)
class Scalar:
    """BOOL, an integer or LREAL; `code` is struct's."""

    name: str
    code: str
    low: int = 0
    high: int = 0

    @property
    def integer(self) -> bool:
        return self.high > self.low

    def checked(self, value: object) -> object:
        kind = int if self.integer else {"BOOL": bool, "LREAL": float}[self.name]
        if type(value) is not kind:
            raise RefusedError(f"{value!r} is no {self.name}")
        return self.fit(value) if self.integer else value

    def fit(self, value: int) -> int:
        if not self.low <= value <= self.high:
            raise RefusedError(f"{value} overflows {self.name}")
        return value


BOOL = Scalar("BOOL", "?")
LREAL = Scalar("LREAL", "d")
UINT, UDINT, ULINT = (Scalar(f"U{n}INT", c, 0, 2**b - 1) for n, c, b in (("", "H", 16), ("D", "I", 32), ("L", "Q", 64)))
INT, DINT, LINT = (
    Scalar(f"{n}INT", c, -(2 ** (b - 1)), 2 ** (b - 1) - 1)
    for n, c, b in (("", "h", 16), ("D", "i", 32), ("L", "q", 64))
)
ANY_INT = Scalar("an integer literal", "", -(2**63), 2**64 - 1)
SCALARS = {kind.name: kind for kind in (BOOL, LREAL, UINT, UDINT, ULINT, INT, DINT, LINT)}


@dataclass(frozen=True)
class Array:
    """Counts from 0 in each dimension; the last index runs fastest."""

    lengths: tuple[int, ...]
    of: Scalar


@dataclass(frozen=True)
class Named:
    """A structure or a function block."""

    name: str


Kind = Scalar | Array | Named


def zero(kind: Scalar | Array) -> object:
    if isinstance(kind, Array):
        return [zero(kind.of)] * prod(kind.lengths)
    return False if kind is BOOL else 0.0 if kind is LREAL else 0


def at(index: int, length: int) -> int:
    """A subscript, held to its bounds (a negative one would mean the end in Python)."""
    if not 0 <= index < length:
        raise RefusedError(f"subscript {index} is not within 0..{length - 1}")
    return index


def quotient(kind: Scalar, a: int, b: int) -> int:
    """Cut off towards zero."""
    if b == 0:
        raise RefusedError(f"{a} / 0")
    return kind.fit(abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1))


def remainder(kind: Scalar, a: int, b: int) -> int:
    if b == 0:
        raise RefusedError(f"{a} MOD 0")
    return kind.fit(abs(a) % abs(b) * (-1 if a < 0 else 1))


def divided(a: float, b: float) -> float:
    if b == 0.0:
        raise RefusedError(f"{a} / 0.0")
    return a / b


def to_lreal(value: int) -> float:
    if abs(value) > 2**53:
        raise RefusedError(f"{value} has no LREAL of its own")
    return float(value)


def image(members: dict[str, tuple[Scalar | Array, object]]) -> bytes:
    """The structure's bytes; refused where members do not lie at multiples of their size without a gap."""
    out = b""
    for name, (kind, value) in members.items():
        scalar = kind.of if isinstance(kind, Array) else kind
        if len(out) % struct.calcsize(f"={scalar.code}"):
            raise RefusedError(f"{name} at byte {len(out)} would lie elsewhere with another packing")
        values = value if isinstance(kind, Array) else [value]
        out += struct.pack(f"<{len(values)}{scalar.code}", *values)
    return out
