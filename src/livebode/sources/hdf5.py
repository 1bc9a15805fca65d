"""HDF5 files, and MATLAB's MAT-files of version 7.3, which are HDF5."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from livebode.core import not_installed
from livebode.sources.arrays import DEPTH_MAX, array_columns, check_nesting
from livebode.sources.friendly import with_friendly_names
from livebode.sources.recording import COLUMNS_MAX, Chunk, Column, Recording, Skipped, oversized
from livebode.tables import PACKED_MAX

UNIT_ATTRIBUTES = "unit", "units", "Unit", "Units"
CHUNK_BYTES_MAX = 1 << 28
PARTS_MAX = 2 * COLUMNS_MAX


class Hdf5Recording(Recording):
    """An HDF5 file. Links into other files are not followed."""

    format: ClassVar[str] = "hdf5"
    named_by_file: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        columns: list[Column] = []
        skipped: list[Skipped] = []
        scalars: dict[str, float] = {}
        with import_h5py(path).File(path, "r") as file:
            scalars.update(attribute_numbers(file))
            for name, dataset in datasets(file):
                add_dataset(name, dataset, columns, skipped, scalars)
        self.columns, self.skipped, self.scalars = tuple(columns), tuple(skipped), scalars

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        with import_h5py(self.path).File(self.path, "r") as file:
            yield from dataset_chunks([file[column.key.array] for column in columns], columns, rows)


def import_h5py(path: Path) -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise not_installed(
            f"{path} needs the package h5py, which is not installed", package="h5py", extra="hdf5", path=str(path)
        ) from None
    return h5py  # type: ignore[no-any-return]


def datasets(file: Any) -> list[tuple[str, Any]]:
    """Path and dataset of everything in the file itself, each once."""
    h5py = import_h5py(Path(file.filename))
    found: list[tuple[str, Any]] = []
    known = {h5py.h5o.get_info(file.id).addr}

    def visit(group: Any, place: str, depth: int) -> None:
        if depth > DEPTH_MAX:
            raise oversized(f"the file is nested deeper than {DEPTH_MAX} levels at {place!r}", DEPTH_MAX, part=place)
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                continue
            item = group[name]
            address = h5py.h5o.get_info(item.id).addr
            if address in known:
                continue
            known.add(address)
            if len(known) > PARTS_MAX:
                raise oversized(f"the file has more than {PARTS_MAX} datasets and groups", PARTS_MAX)
            if isinstance(item, h5py.Dataset):
                found.append((f"{place}{name}", item))
            elif isinstance(item, h5py.Group):
                visit(item, f"{place}{name}/", depth + 1)

    visit(file, "", 0)
    return found


def add_dataset(
    name: str, dataset: Any, columns: list[Column], skipped: list[Skipped], scalars: dict[str, float], tie_axis: int = 0
) -> None:
    """Add the columns of `dataset` under `name`, which may differ from its path in the file."""
    if why := unreadable(dataset):
        skipped.append(Skipped(name, why))
        return
    found, why_not = array_columns(name, dataset.shape, dataset.dtype, unit_of(dataset), tie_axis)
    columns += [replace(column, key=replace(column.key, array=dataset.name)) for column in found]
    skipped += [why_not] if why_not else []
    for column in found:
        if column.samples == 1:
            scalars[column.name] = float(np.asarray(dataset[()]).ravel()[0])


def dataset_chunks(sets: Sequence[Any], columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
    samples = columns[0].key.samples
    for first in range(0, samples, rows):
        last = min(first + rows, samples)
        yield [np.asarray(one[column.key.at(first, last)]) for one, column in zip(sets, columns)]


def unreadable(dataset: Any) -> str:
    """Why a dataset cannot be read; empty if it can."""
    if dataset.shape is None:
        return "it is empty"
    if dataset.is_virtual or dataset.external:
        return "its values are in other files"
    size = math.prod(dataset.shape) * dataset.dtype.itemsize
    stored = dataset.id.get_storage_size()
    if size and dataset.dtype.kind in "fiub" and stored * PACKED_MAX < size:
        return f"it declares {size} bytes but {stored} are in the file"
    if dataset.chunks and math.prod(dataset.chunks) * dataset.dtype.itemsize > CHUNK_BYTES_MAX:
        return f"its chunks {dataset.chunks} are larger than {CHUNK_BYTES_MAX} bytes"
    return ""


def unit_of(dataset: Any) -> str:
    for key in UNIT_ATTRIBUTES:
        if key in dataset.attrs:
            value = dataset.attrs[key]
            return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return ""


def attribute_numbers(file: Any) -> dict[str, float]:
    numbers = {}
    for key, value in file.attrs.items():
        array = np.asarray(value)
        if array.size == 1 and array.dtype.kind in "fiu":
            numbers[key] = float(array.ravel()[0])
    return numbers


class Matlab73Recording(Recording):
    """A v7.3 file; paths such as rec.Y(3).Data lead into structs, numbered from 1."""

    format: ClassVar[str] = "mat"
    named_by_file: ClassVar[bool] = True

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
        check_nesting(name, depth, self._steps)
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
