"""EdgeBuffer: messages on disk until the log has stored them, in files of bounded size."""

from __future__ import annotations

import contextlib
import logging
import struct
import threading
from collections import deque
from pathlib import Path

from livebode.core import FleetError, RecordError, remove_files, sync_directory
from livebode.dataclass import dataclass
from livebode.records import AppendFile, Lock, frames, read_bytes, to_frame

FILE_BYTES = 1 << 20
_logger = logging.getLogger(f"livebode.{__name__}")
_NUMBER = struct.Struct("<Q")
_KIND = 1
_SUFFIX = ".buffer"


@dataclass
class _File:
    """A file, its messages that are not stored yet, which begin at byte `start`, and whether it is undamaged."""

    name: str
    size_bytes: int = 0
    count: int = 0
    start: int = 0
    whole: bool = True


@dataclass(frozen=True)
class _Message:
    """A message, its number, and the byte at which it ends in its file."""

    number: int
    data: bytes
    end: int


class EdgeBuffer:
    """A queue of messages that outlasts the process, the log and the connection between them.

    A message is appended to the newest file with its number in a frame of a record's journal, so that damage is
    detected and costs the messages that it hit. A file is deleted when all of its messages are stored. After a restart
    the messages of the oldest file may be sent again: the log and the sequencer drop repeats. Above `bytes_max` the
    oldest file is deleted, and its messages are counted: the newest data are the ones that a person needs, and the
    sender's numbers give what is missing exactly.

    One thread may append while another takes and a third one syncs; one process at a time uses a directory.

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
        If the directory cannot be used, or another process uses it.
    """

    def __init__(self, directory: Path, bytes_max: int, file_bytes: int = FILE_BYTES) -> None:
        self._directory, self._file_bytes = directory, file_bytes
        self._bytes_max = max(bytes_max, 2 * file_bytes)
        self._lock = threading.Lock()
        self._files: deque[_File] = deque()
        self._loaded: deque[_Message] = deque()
        self._next, self._index = 0, 0
        self._open: list[AppendFile] = []
        self._unsynced = False
        self.dropped = 0
        """Messages deleted because the buffer was full."""
        self.damaged = 0
        """Files with damaged or missing messages."""
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._locked = Lock(directory)
        except OSError as error:
            raise _unusable(directory, error) from None
        except RecordError:
            raise FleetError(
                "buffer-locked",
                f"another process uses the buffer {str(directory)!r}",
                "stop it first, or set edge.buffer to another directory",
                path=str(directory),
            ) from None
        try:
            self._recover()
            self._begin_file()
        except OSError as error:
            self._locked.release()
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
        """Add a message; deletes the oldest file if the buffer is full.

        Raises
        ------
        FleetError
            If the disk does not take the message; those before it remain.
        """
        with self._lock:
            frame = to_frame(_KIND, _NUMBER.pack(self._next), message)
            try:
                if self._files[-1].size_bytes + len(frame) > self._file_bytes and self._files[-1].count:
                    self._begin_file()
                while (
                    sum(file.size_bytes for file in self._files) + len(frame) > self._bytes_max and len(self._files) > 1
                ):
                    self._drop()
                self._open[-1].append(frame)
            except OSError as error:
                raise _unusable(self._directory, error) from None
            self._next += 1
            self._unsynced = True
            self._files[-1].count += 1
            self._files[-1].size_bytes += len(frame)

    def first(self) -> bytes | None:
        """The oldest message; None if there is none."""
        with self._lock:
            while not self._loaded and (self._files[0].count or len(self._files) > 1):
                self._load()
            return self._loaded[0].data if self._loaded else None

    def remove(self, message: bytes) -> None:
        """Remove the oldest message, which is stored; one that was dropped meanwhile is not counted as dropped."""
        if self.first() != message:
            self.dropped -= 1
            return
        with self._lock:
            oldest = self._files[0]
            oldest.start = self._loaded.popleft().end
            oldest.count -= 1
            if oldest.count:
                return
            if len(self._files) > 1:
                self._delete_oldest()
                return
            self._files[0] = _File(oldest.name)
            self._open[-1].back_to(0)
            with contextlib.suppress(OSError):  # else the next message cuts it
                self._open[-1].append(b"")

    def sync(self) -> None:
        """Sync what was appended and is not stored yet, so that it survives a power cut; OSError if this failed."""
        with self._lock:
            if not self._unsynced or not any(file.count for file in self._files):
                return
            self._unsynced, opened = False, list(self._open)
        try:
            for file in opened:
                file.sync()
            sync_directory(self._directory)
        except OSError:
            self._unsynced = True
            raise
        with self._lock:
            for file in opened[:-1]:
                file.close()
                self._open.remove(file)

    def close(self) -> None:
        """Sync and close; what the buffer contains remains."""
        with contextlib.suppress(OSError):
            self.sync()
        with self._lock:
            for file in self._open:
                file.close()
            self._locked.release()

    def _recover(self) -> None:
        """Find the messages of the previous process; damage is named, and costs the messages that it hit."""
        following: int | None = None
        before = _File("")
        for path in sorted(self._directory.glob(f"*{_SUFFIX}")):
            if not path.stem.isdecimal():
                continue
            self._index = int(path.stem) + 1
            file = _File(path.name)
            messages = self._read(file)
            if messages and before.whole and following not in (None, messages[0].number):
                self._name_damage(before)
            if not file.whole:
                self._name_damage(file)
            if messages:
                following = messages[-1].number + 1
                self._files.append(file)
            elif file.whole:
                remove_files(self._directory, [path.name])
            file.count, before = len(messages), file
        self._next = following or 0

    def _read(self, file: _File) -> list[_Message]:
        """The messages from its `start` on; sets its size, and whether they are all that was there."""
        try:
            data = read_bytes(self._directory, file.name)[file.start :]
        except (OSError, RecordError):
            file.whole = False
            return []
        file.size_bytes = file.start + len(data)
        found, whole, end = list[_Message](), True, 0
        for frame in frames(data):
            end = frame.end
            if frame.payload is None or len(frame.payload) < _NUMBER.size:
                whole = False
                continue
            (number,) = _NUMBER.unpack_from(frame.payload)
            whole &= not found or number == found[-1].number + 1
            found.append(_Message(number, bytes(frame.payload[_NUMBER.size :]), file.start + end))
        file.whole = whole and end == len(data)
        return found

    def _load(self) -> None:
        """Read the messages of the oldest file; where none is left, the next file is the oldest one."""
        oldest = self._files[0]
        self._loaded.extend(self._read(oldest))
        if len(self._loaded) < oldest.count:
            self._name_damage(oldest)
        oldest.count = len(self._loaded)
        if not self._loaded and len(self._files) > 1:
            self._files.popleft()  # not deleted: what cannot be read now may be readable at the next start

    def _name_damage(self, file: _File) -> None:
        self.damaged += 1
        _logger.warning("%s is damaged or incomplete; the messages at that place are lost", self._directory / file.name)

    def _begin_file(self) -> None:
        file = _File(f"{self._index:012d}{_SUFFIX}")
        self._open.append(AppendFile(self._directory, file.name, 0))
        self._index += 1
        while self._files and not self._files[0].count:
            self._delete_oldest()
        self._files.append(file)

    def _drop(self) -> None:
        self.dropped += self._files[0].count
        self._loaded.clear()
        self._delete_oldest()

    def _delete_oldest(self) -> None:
        remove_files(self._directory, [self._files.popleft().name])


def _unusable(directory: Path, error: OSError) -> FleetError:
    return FleetError(
        "buffer-unusable",
        f"the buffer {str(directory)!r} cannot be read or written: {error.strerror or error}",
        "check the disk and the permissions",
        path=str(directory),
    )
