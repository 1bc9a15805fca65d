"""A part of a Parquet file with its checksum."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import BinaryIO

_BLOCK = 1 << 20


@dataclass(frozen=True)
class ParquetPart:
    """Consecutive bytes of a Parquet file: a row group, or, with no rows, the bytes after the last one."""

    rows: int
    size_bytes: int
    sha256: str


def sha256_of_next(file: BinaryIO, size: int) -> str:
    """The checksum of the next `size` bytes, in hexadecimal form."""
    found = hashlib.sha256()
    while size > 0 and (block := file.read(min(size, _BLOCK))):
        found.update(block)
        size -= len(block)
    return found.hexdigest()
