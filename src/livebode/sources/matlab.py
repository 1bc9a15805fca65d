"""MATLAB v5 (also v6 and v7): vectors streamed, other variables read one by one by SciPy, structs walked for paths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import needing
from livebode.sources.arrays import array_columns
from livebode.sources.damage import oversized
from livebode.sources.friendly import with_friendly_names
from livebode.sources.mat5check import list_variables
from livebode.sources.mat5stream import stream, streamable
from livebode.sources.recording import COLUMNS_MAX, Chunk, Column, Recording, Skipped

with needing("SciPy", "analysis", "a MATLAB file"):
    from scipy.io import loadmat

NUMERIC = {
    "double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
}  # fmt: skip
DEPTH_MAX = 32


class MatlabRecording(Recording):
    """A v5 file. A matrix, and what is in a struct, has to fit in memory; a vector does not."""

    format: ClassVar[str] = "mat"

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
        if depth > DEPTH_MAX or self._steps > COLUMNS_MAX:
            raise oversized(
                f"the file is nested deeper than {DEPTH_MAX} levels or has more than {COLUMNS_MAX} parts at {name!r}",
                COLUMNS_MAX,
                part=name,
            )
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
