"""NPZ: members streamed from the zip archive, compressed or not; pickled objects are never loaded."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, ClassVar

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from livebode.dataclass import dataclass
from livebode.sources.arrays import Slot, array_columns
from livebode.sources.recording import COLUMNS_MAX, Chunk, Column, Recording, Skipped, oversized, truncated

HEADER_BYTES_MAX = 10_000


@dataclass(frozen=True)
class Member:
    """Header of one array: shape, order in the file, type, and where its values begin in the member."""

    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype[np.generic]
    offset: int


class NpzRecording(Recording):
    """A NumPy archive; the headers of all members are read at once, values only on request."""

    format: ClassVar[str] = "npz"
    named_by_file: ClassVar[bool] = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        columns: list[Column] = []
        skipped: list[Skipped] = []
        self._members: dict[str, Member] = {}
        with zipfile.ZipFile(path) as archive:
            if len(archive.infolist()) > COLUMNS_MAX:
                members = len(archive.infolist())
                raise oversized(
                    f"{path} has {members} members, more than {COLUMNS_MAX}",
                    COLUMNS_MAX,
                    path=str(path),
                    members=members,
                )
            for info in archive.infolist():
                name = info.filename.removesuffix(".npy")
                with archive.open(info) as file:
                    member = self._members[name] = read_header(file, info)
                found, why = array_columns(name, member.shape, member.dtype)
                columns += found
                skipped += [why] if why else []
            self.scalars = self._read_scalars(archive, columns)
        self.columns, self.skipped = tuple(columns), tuple(skipped)

    def _read_scalars(self, archive: zipfile.ZipFile, columns: Sequence[Column]) -> dict[str, float]:
        single = [column for column in columns if column.samples == 1]
        scalars = {}
        for column in single:
            with Series(archive, column.key, self._members[column.key.array]) as series:
                scalars[column.name] = float(series.read(1)[0])
        return scalars

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        with ExitStack() as stack:
            archive = stack.enter_context(zipfile.ZipFile(self.path))
            series = [
                stack.enter_context(Series(archive, column.key, self._members[column.key.array])) for column in columns
            ]
            left = columns[0].key.samples
            while left > 0:
                count = min(rows, left)
                yield [one.read(count) for one in series]
                left -= count


class Series:
    """One series of a member, read forward; every series has a stream of its own."""

    def __init__(self, archive: zipfile.ZipFile, slot: Slot, member: Member) -> None:
        self._file = archive.open(f"{slot.array}.npy" if f"{slot.array}.npy" in archive.namelist() else slot.array)
        first, self._stride = slot.strides(fortran=member.fortran)
        self._dtype = member.dtype
        self._phase = first % self._stride
        self._name = slot.array
        self._file.seek(member.offset + (first - self._phase) * member.dtype.itemsize)

    def __enter__(self) -> Series:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, count: int) -> NDArray[Any]:
        size = count * self._stride * self._dtype.itemsize
        raw = self._file.read(size)
        if len(raw) != size:
            missing = size - len(raw)
            raise truncated(f"array {self._name!r} ends {missing} bytes early", part=self._name, missing_bytes=missing)
        return np.frombuffer(raw, self._dtype)[self._phase :: self._stride]


def read_header(file: IO[bytes], info: zipfile.ZipInfo) -> Member:
    """Header of a .npy member, compared with the size that the archive states for it."""
    version = npy.read_magic(file)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran, dtype = read(file, max_header_size=HEADER_BYTES_MAX)
    member = Member(shape, fortran, dtype, file.tell())
    needed = member.offset + math.prod(shape) * dtype.itemsize
    if any(length < 0 for length in shape) or (not dtype.hasobject and needed > info.file_size):
        raise truncated(
            f"{info.filename!r} declares shape {shape}, more than its {info.file_size} bytes",
            part=info.filename,
            shape=list(shape),
        )
    return member
