"""EdgeBuffer: messages on disk until the log has stored them, in files of bounded size."""

from __future__ import annotations

import logging
import os
import struct
import threading
import zlib
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from livebode.core.errors import FleetError

FILE_BYTES = 1 << 20
_logger = logging.getLogger(__name__)
_HEAD = struct.Struct("<II")
_SUFFIX = ".buffer"


@dataclass
class _File:
    path: Path
    count: int = 0
    size_bytes: int = 0


class EdgeBuffer:
    """A queue of messages that outlasts the process, the log and the connection between them.

    A message is appended to the newest file, with its length and CRC-32, and a file is deleted when all of its messages
    are stored. After a restart the messages of the oldest file may be sent again: the log and the sequencer drop
    repeats. Above `bytes_max` the oldest file is deleted, and its messages are counted: the newest data are the ones
    that a person needs, and the sender's numbers give what is missing exactly. One thread may append while another
    takes.

    Parameters
    ----------
    directory
        Created if it is missing; of this buffer alone.
    bytes_max
        Most bytes on disk, at least two files.
    file_bytes
        Size of a file.

    Raises
    ------
    FleetError
        If the directory or a file in it cannot be read or written.
    """

    def __init__(self, directory: Path, bytes_max: int, file_bytes: int = FILE_BYTES) -> None:
        self._directory, self._file_bytes = directory, file_bytes
        self._bytes_max = max(bytes_max, 2 * file_bytes)
        self._lock = threading.Lock()
        self._files: deque[_File] = deque()
        self._taken: deque[bytes] = deque()
        self._write = -1
        self.dropped = 0
        """Messages deleted because the buffer was full."""
        self.damaged = 0
        """Files whose end was incomplete, as after a power cut."""
        try:
            directory.mkdir(parents=True, exist_ok=True)
            for path in sorted(directory.glob(f"*{_SUFFIX}")):
                size_bytes, found = path.stat().st_size, self._read(path)
                self._files.append(_File(path, len(found), size_bytes))
                if sum(map(len, found)) + _HEAD.size * len(found) != size_bytes:
                    self.damaged += 1
                    _logger.warning("%s has an incomplete end, as after a power cut; its message is lost", path)
            self._begin_file()
        except OSError as error:
            raise _unusable(directory, error) from None

    def __len__(self) -> int:
        """Messages that are not stored yet."""
        with self._lock:
            return sum(file.count for file in self._files)

    @property
    def size_bytes(self) -> int:
        """Bytes on disk."""
        with self._lock:
            return sum(file.size_bytes for file in self._files)

    def append(self, message: bytes) -> None:
        """Add a message; deletes the oldest file if there is no room."""
        record = _HEAD.pack(len(message), zlib.crc32(message)) + message
        with self._lock:
            try:
                if self._files[-1].size_bytes + len(record) > self._file_bytes and self._files[-1].count:
                    self._begin_file()
                while sum(file.size_bytes for file in self._files) > self._bytes_max and len(self._files) > 1:
                    self._drop()
                os.write(self._write, record)
            except OSError as error:
                raise _unusable(self._directory, error) from None
            self._files[-1].count += 1
            self._files[-1].size_bytes += len(record)

    def first(self) -> bytes | None:
        """The oldest message; None if there is none."""
        with self._lock:
            if not self._taken and self._files[0].count:
                try:
                    self._taken.extend(self._read(self._files[0].path)[-self._files[0].count :])
                except OSError as error:
                    raise _unusable(self._directory, error) from None
            return self._taken[0] if self._taken else None

    def remove(self, message: bytes) -> None:
        """Remove the oldest message, which is stored; one that was dropped meanwhile is not counted as dropped."""
        with self._lock:
            if not self._taken or self._taken[0] is not message:
                self.dropped -= 1
                return
            self._taken.popleft()
            self._files[0].count -= 1
            if self._files[0].count:
                return
            if len(self._files) > 1:
                self._files.popleft().path.unlink(missing_ok=True)
            else:
                os.ftruncate(self._write, 0)
                self._files[0].size_bytes = 0

    def close(self) -> None:
        """Close the file; what it contains remains."""
        with self._lock:
            os.close(self._write)

    def _begin_file(self) -> None:
        if self._write >= 0:
            os.close(self._write)
        number = int(self._files[-1].path.stem) + 1 if self._files else 0
        path = self._directory / f"{number:012d}{_SUFFIX}"
        self._write = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        while self._files and not self._files[0].count:
            self._files.popleft().path.unlink(missing_ok=True)
        self._files.append(_File(path))

    def _drop(self) -> None:
        oldest = self._files.popleft()
        oldest.path.unlink(missing_ok=True)
        self.dropped += oldest.count
        self._taken.clear()

    def _read(self, path: Path) -> list[bytes]:
        data, at, found = path.read_bytes(), 0, []
        while at + _HEAD.size <= len(data):
            length, check = _HEAD.unpack_from(data, at)
            message = data[at + _HEAD.size : at + _HEAD.size + length]
            if len(message) != length or zlib.crc32(message) != check:
                break
            found.append(message)
            at += _HEAD.size + length
        return found


def _unusable(directory: Path, error: OSError) -> FleetError:
    return FleetError(
        "buffer-unusable",
        f"the buffer {str(directory)!r} cannot be read or written: {error.strerror or error}",
        "check the disk and the permissions",
        path=str(directory),
    )
