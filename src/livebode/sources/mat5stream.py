"""The values of a vector in a MATLAB v5 file, piece by piece: the memory does not depend on its length."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebode.sources.damage import damaged, truncated
from livebode.sources.mat5check import (
    COMPRESSED,
    DIMENSIONS,
    FLAGS,
    TEXT,
    UNPACKED_MAX,
    MatlabWalk,
    Plain,
    Unpacked,
    Variable,
)

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
LENGTH_MIN = 1024
"""Of a vector that is streamed; the values of short ones may be inside a tag."""


def streamable(variable: Variable) -> bool:
    """Whether it is one long column or row: of a matrix, the samples of a channel are in several places."""
    return max(variable.shape, default=0) >= LENGTH_MIN and sorted(variable.shape)[:-1] == [1] * (
        len(variable.shape) - 1
    )


def stream(path: Path, variable: Variable, rows: int) -> Iterator[NDArray[np.generic]]:
    """The values of a vector that `list_variables` has checked, `rows` at a time, in the type in which they are stored.

    MATLAB stores numbers in the smallest type that has them all, whatever their class.
    """
    with path.open("rb") as file:
        file.seek(variable.byte)
        kind, length = struct.unpack(variable.order + "II", file.read(8))
        source: Plain | Unpacked = Plain(file)
        walk = MatlabWalk(source, variable.order)
        if kind == COMPRESSED:
            source = Unpacked(file, length)
            walk = MatlabWalk(source, variable.order)
            _, length = walk.tag(UNPACKED_MAX)
        for types in (FLAGS, DIMENSIONS, TEXT):
            _, _, length = walk.element(length, 0, types)
        kind, length = walk.tag(length)
        stored, count = np.dtype(variable.order + _TYPES.get(kind, "V1")), max(variable.shape)
        if stored.kind == "V" or length != count * stored.itemsize:
            raise damaged(
                f"the variable {variable.name} declares {count} values, and has {length} bytes of type {kind}",
                declared=count,
            )
        while length:
            piece = source.read(min(length, rows * stored.itemsize))
            if not piece:
                raise truncated(f"the variable {variable.name} ends {length} bytes early", missing_bytes=length)
            length -= len(piece)
            yield np.frombuffer(piece, stored)
