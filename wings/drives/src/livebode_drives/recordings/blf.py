"""BLF, the binary log of Vector: frames read by python-can, after a check of the objects and their sizes.

python-can decompresses a container of any size at once, keeps an object that never ends in memory, and does not return
from one of size 0.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import IO, Any, ClassVar

from livebode.sources import damaged, oversized, truncated
from livebode_drives.recordings.can import VectorRecording, import_can

FILE_HEAD = struct.Struct("<4sL")
OBJECT_HEAD = struct.Struct("<4sHHLL")
CONTAINER_HEAD = struct.Struct("<H6xL4x")
CONTAINER = 10
CONTAINER_BYTES_MAX = 1 << 26
OBJECT_BYTES_MAX = 1 << 24


def check(file: IO[bytes], size: int) -> None:
    """RecordingError for a file whose objects contradict their sizes.

    Parameters
    ----------
    file
        The file at its beginning.
    size
        Its length in bytes.
    """
    _, position = FILE_HEAD.unpack(file.read(FILE_HEAD.size).ljust(FILE_HEAD.size, b"\0"))
    if not 144 <= position <= size:
        raise damaged(f"its header declares {position} bytes of {size}", size=position)
    remainder = b""
    while position < size:
        file.seek(position)
        signature, _, _, length, kind = OBJECT_HEAD.unpack(file.read(OBJECT_HEAD.size).ljust(OBJECT_HEAD.size, b"\0"))
        if signature != b"LOBJ" or length < OBJECT_HEAD.size:
            raise damaged(f"there is no object at byte {position}", byte=position)
        if position + length > size:
            raise truncated(f"the object at byte {position} ends {position + length - size} bytes early", byte=position)
        if kind == CONTAINER:
            remainder = after_objects(remainder + content_of(file, position, length), position)
        position += length + length % 4
    if remainder.strip(b"\0"):
        raise truncated(f"its last object ends {len(remainder)} bytes after its beginning")


def content_of(file: IO[bytes], position: int, length: int) -> bytes:
    """The bytes of a container at `at`, at most as many as it declares."""
    if not OBJECT_HEAD.size + CONTAINER_HEAD.size <= length <= CONTAINER_BYTES_MAX:
        raise oversized(f"the container at byte {position} has {length} bytes", CONTAINER_BYTES_MAX, byte=position)
    raw = file.read(length - OBJECT_HEAD.size)
    method, declared = CONTAINER_HEAD.unpack_from(raw)
    if method != 2:
        return raw[CONTAINER_HEAD.size :] if method == 0 else b""
    if declared > CONTAINER_BYTES_MAX:
        raise oversized(
            f"the container at byte {position} declares {declared} bytes", CONTAINER_BYTES_MAX, byte=position
        )
    content = zlib.decompressobj().decompress(raw[CONTAINER_HEAD.size :], declared + 1)
    if len(content) != declared:
        raise damaged(
            f"the container at byte {position} does not have the {declared} bytes that it declares", byte=position
        )
    return content


def after_objects(data: bytes, position: int) -> bytes:
    """The object at the end of the container at byte `at` that continues in the next container, or nothing."""
    here = 0
    while True:
        start = data.find(b"LOBJ", here, here + 8)
        if start < 0 and here + 8 <= len(data):
            raise damaged(f"the container at byte {position} has no object at its byte {here}", byte=position)
        if start < 0 or start + OBJECT_HEAD.size > len(data):
            return data[here:]
        _, head, _, length, _ = OBJECT_HEAD.unpack_from(data, start)
        if not OBJECT_HEAD.size < head <= length <= OBJECT_BYTES_MAX:
            raise damaged(
                f"the container at byte {position} has an object of {length} bytes", byte=position, size=length
            )
        if start + length > len(data):
            return data[here:]
        here = start + length


class BlfRecording(VectorRecording):
    """A BLF file; see VectorRecording."""

    format: ClassVar[str] = "blf"

    def __init__(self, path: Path, dbc: Path | None) -> None:
        with path.open("rb") as file:
            check(file, path.stat().st_size)
        super().__init__(path, dbc)

    def _reader(self, file: IO[bytes]) -> Any:
        reader = import_can(self.path).BLFReader(file)
        reader.start_timestamp = 0.0  # a date in seconds would leave a double 0.2 µs of resolution
        return reader
