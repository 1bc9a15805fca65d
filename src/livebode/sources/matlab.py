"""MATLAB's MAT-files of version 5."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import needing
from livebode.sources.arrays import array_columns, check_nesting
from livebode.sources.friendly import with_friendly_names
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
    list_variables,
)
from livebode.sources.recording import Chunk, Column, Recording, Skipped, damaged, truncated

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


with needing("SciPy", "analysis", "a MATLAB file"):
    from scipy.io import loadmat

NUMERIC = {
    "double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
}  # fmt: skip


class MatlabRecording(Recording):
    """A v5 file. A matrix, and what is in a struct, has to fit in memory; a vector does not."""

    format: ClassVar[str] = "mat"
    named_by_file: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        walk = MatlabCollector()
        singles: list[str] = []
        variables = list_variables(path)
        for variable in variables:
            name = variable.name
            if variable.kind in NUMERIC and not variable.is_complex:
                walk.number(name, variable.shape, np.dtype(np.float64))
                singles += [name] if math.prod(variable.shape) == 1 else []
            elif variable.kind == "struct":
                walk.visit(name, load(path, [name])[name], 0)
            else:
                walk.skipped.append(Skipped(name, f"it is of class {'complex ' * variable.is_complex}{variable.kind}"))
        values = load(path, singles) if singles else {}
        walk.scalars.update({name: float(values[name].ravel()[0]) for name in singles})
        self.columns = with_friendly_names(walk.columns, walk.texts)
        self.skipped, self.scalars = tuple(walk.skipped), walk.scalars
        self._paths = walk.arrays
        self._vectors = {variable.name: variable for variable in variables if streamable(variable)}

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        names = {column.key.array for column in columns}
        streams = {name: stream(self.path, self._vectors[name], rows) for name in names & self._vectors.keys()}
        plain = sorted(names - self._paths.keys() - streams.keys())
        arrays = {**self._paths, **(load(self.path, plain) if plain else {})}
        samples = columns[0].key.samples
        for first in range(0, samples, rows):
            pieces = {name: next(values) for name, values in streams.items()}
            yield [
                pieces[name] if name in pieces else arrays[name][column.key.at(first, min(first + rows, samples))]
                for column in columns
                for name in (column.key.array,)
            ]


def load(path: Path, names: list[str]) -> dict[str, Any]:
    variables: dict[str, Any] = loadmat(str(path), variable_names=names, squeeze_me=False, chars_as_strings=True)
    return variables


class MatlabCollector:
    """Collects columns, texts and scalars from variables and the fields of structs."""

    def __init__(self) -> None:
        self.columns: list[Column] = []
        self.skipped: list[Skipped] = []
        self.scalars: dict[str, float] = {}
        self.texts: dict[str, str] = {}
        self.arrays: dict[str, NDArray[Any]] = {}
        """Arrays inside structs by path."""
        self._steps = 0

    def number(self, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        found, why = array_columns(name, shape, dtype)
        self.columns += found
        self.skipped += [why] if why else []

    def visit(self, name: str, value: Any, depth: int) -> None:
        self._steps += 1
        check_nesting(name, depth, self._steps)
        if not isinstance(value, np.ndarray):
            self.skipped.append(Skipped(name, f"it is of type {type(value).__name__}"))
        elif value.dtype.names:
            self._struct(name, value, depth)
        elif value.dtype.kind == "U":
            self.texts[name] = "".join(value.ravel().tolist())
        elif value.dtype.kind == "O":
            self.skipped.append(Skipped(name, "it is a cell array"))
        else:
            self._number_in_struct(name, value)

    def _struct(self, name: str, value: NDArray[Any], depth: int) -> None:
        elements = value.ravel(order="F")
        for at, element in enumerate(elements, start=1):
            stem = f"{name}({at})" if len(elements) > 1 else name
            for field in value.dtype.names or ():
                self.visit(f"{stem}.{field}", element[field], depth + 1)

    def _number_in_struct(self, name: str, value: NDArray[Any]) -> None:
        self.number(name, value.shape, value.dtype)
        self.arrays[name] = value
        if value.size == 1 and value.dtype.kind in "fiub":
            self.scalars[name] = float(value.ravel()[0])
