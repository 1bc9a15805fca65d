"""MATLAB 7.3: HDF5 with MATLAB's conventions. Axes are reversed, structs are groups, struct arrays are references."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from livebode.sources.damage import oversized
from livebode.sources.friendly import with_friendly_names
from livebode.sources.hdf5 import DEPTH_MAX, add_dataset, dataset_chunks, import_h5py
from livebode.sources.recording import COLUMNS_MAX, Chunk, Column, Recording, Skipped


class Matlab73Recording(Recording):
    """A v7.3 file; paths such as rec.Y(3).Data lead into structs, numbered from 1."""

    format: ClassVar[str] = "mat"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        walk = Hdf5Collector(path)
        with import_h5py(path).File(path, "r") as file:
            walk.file = file
            for name in file:
                if not name.startswith("#"):
                    walk.visit(name, file[name], 0)
        self.columns = with_friendly_names(walk.columns, walk.texts)
        self.skipped, self.scalars = tuple(walk.skipped), walk.scalars

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        with import_h5py(self.path).File(self.path, "r") as file:
            yield from dataset_chunks([file[column.key.array] for column in columns], columns, rows)


class Hdf5Collector:
    """Collects columns, texts and scalars from the groups of a file."""

    def __init__(self, path: Path) -> None:
        self.h5py = import_h5py(path)
        self.file: Any = None
        self.columns: list[Column] = []
        self.skipped: list[Skipped] = []
        self.scalars: dict[str, float] = {}
        self.texts: dict[str, str] = {}
        self._steps = 0

    def visit(self, name: str, item: Any, depth: int) -> None:
        self._steps += 1
        if depth > DEPTH_MAX or self._steps > COLUMNS_MAX:
            raise oversized(
                f"the file is nested deeper than {DEPTH_MAX} levels or has more than {COLUMNS_MAX} parts at {name!r}",
                COLUMNS_MAX,
                part=name,
            )
        if isinstance(item, self.h5py.Group):
            for field in item:
                self._field(name, field, item[field], depth)
        elif not isinstance(item, self.h5py.Dataset) or item.attrs.get("MATLAB_empty", 0):
            self.skipped.append(Skipped(name, "it is empty"))
        elif is_class(item, b"char"):
            self.texts[name] = text_of(item)
        elif item.dtype == self.h5py.ref_dtype:
            self.skipped.append(Skipped(name, "it is a cell array"))
        else:
            add_dataset(name, item, self.columns, self.skipped, self.scalars, tie_axis=1)

    def _field(self, name: str, field: str, item: Any, depth: int) -> None:
        """A field of a struct, or, as references, that field of every element of a struct array."""
        elements = isinstance(item, self.h5py.Dataset) and item.dtype == self.h5py.ref_dtype
        if not elements or is_class(item, b"cell"):
            self.visit(f"{name}.{field}", item, depth + 1)
            return
        if item.size > COLUMNS_MAX:
            count = int(item.size)
            raise oversized(
                f"the struct array {name!r} has {count} elements, more than {COLUMNS_MAX}", COLUMNS_MAX, part=name
            )
        for at, reference in enumerate(np.asarray(item[()]).ravel(), start=1):
            if reference:
                self.visit(f"{name}({at}).{field}", self.file[reference], depth + 1)


def is_class(item: Any, name: bytes) -> bool:
    value = item.attrs.get("MATLAB_class", b"")
    return (value.encode() if isinstance(value, str) else bytes(value)) == name


def text_of(item: Any) -> str:
    if item.size > 10_000 or item.dtype.kind not in "iu":
        return ""
    return "".join(chr(code) for code in np.asarray(item[()]).ravel().tolist() if 0 < code < 0x110000)
