"""Recordings that a browser sends: streamed to the disk, recognised, and only then in their place."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from starlette.requests import ClientDisconnect

from livebode.core import LivebodeError, ServerError, output_files, remove_empty, remove_files, write_whole
from livebode.language import Message
from livebode.records import Lock, read_bytes
from livebode.sources import open_file
from livebode_start.workspace import Workspace, harmless_name

UPLOAD_BYTES_MAX = 4_000_000_000
"""Largest recording."""
RESERVE_BYTES = 256 << 20
"""Space of the disk that an upload leaves to runs and others."""
UPLOADS_MAX = 4
"""At the same time."""
_PIECE_BYTES = 1 << 20
_MARK, _MARK_BYTES_MAX = "livebode-upload.json", 4096
"""File beside the part that has come: livebode wrote both."""
_KIND = "upload"


class Uploads:
    """Receives recordings into a workspace.

    Parameters
    ----------
    workspace
        Where they are put.
    """

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._names: set[str] = set()

    async def receive(self, name: str, size_bytes: int | None, parts: AsyncIterator[bytes]) -> str:
        """Store a recording and return its name, which has a number if another file has the given one.

        Parameters
        ----------
        name
            As its owner calls it.
        size_bytes
            Announced length; None without one.
        parts
            The content.

        Raises
        ------
        ServerError
            If it is too long, the disk has no room for it, or it ended early; nothing remains of it.
        RecordingError
            If no reader recognises it; nothing remains of it.
        OutputError
            If the system refuses to write it.
        """
        if len(self._names) >= UPLOADS_MAX:
            raise ServerError(
                "busy", Message("{count} recordings are being received already", count=UPLOADS_MAX),
                Message("try again in a moment"), limit=UPLOADS_MAX,
            )  # fmt: skip
        size_bytes = _checked_size(size_bytes)
        name = self._workspace.free_name(harmless_name(name), self._names)
        self._names.add(name)
        try:
            with output_files(self._workspace.directory, _KIND) as partial, _marked(partial, name):
                _check_room(partial, size_bytes)
                await _write(partial / name, parts)
                with self._workspace.short_names(partial):
                    await asyncio.to_thread(_check_recording, partial / name, size_bytes)
                self._workspace.check_free(name)
        finally:
            self._names.discard(name)
        return name


def remove_abandoned(directory: Path) -> None:
    """Remove what servers that were killed had received until then.

    Only what the mark beside it names, and only where no other server is still receiving; anything else remains.
    """
    for partial in sorted(directory.glob(f".{_KIND}.partial-*")):
        with contextlib.suppress(LivebodeError, OSError, ValueError, KeyError, TypeError):
            if partial.is_symlink():
                continue
            lock = Lock(partial)
            try:
                name = json.loads(read_bytes(partial, _MARK, _MARK_BYTES_MAX))["recording"]
                remove_files(partial, [name, _MARK])  # which refuses a name with a path
            finally:
                lock.release()
            remove_empty(partial)


@contextlib.contextmanager
def _marked(partial: Path, name: str) -> Iterator[None]:
    """The mark of a recording that comes; the lock is that of this process, which ends with it."""
    lock = Lock(partial)
    try:
        write_whole(partial / _MARK, json.dumps({"recording": name}).encode())
        yield
        remove_files(partial, [_MARK])
    finally:
        lock.release()


def _checked_size(size_bytes: int | None) -> int:
    if size_bytes is None:
        raise ServerError("request-malformed", "the upload has no length", "send it with a content-length")
    if size_bytes > UPLOAD_BYTES_MAX:
        raise ServerError(
            "upload-too-long",
            Message(
                "the recording has {size:.1f} GB, and the page receives at most {limit:.0f} GB",
                size=size_bytes / 1e9,
                limit=UPLOAD_BYTES_MAX / 1e9,
            ),
            Message("copy it into the directory of the runs, where the page lists it"),
            bytes=size_bytes,
            limit=UPLOAD_BYTES_MAX,
        )
    return size_bytes


def _check_room(directory: Path, size_bytes: int) -> None:
    free = shutil.disk_usage(directory).free
    if size_bytes + RESERVE_BYTES > free:
        raise ServerError(
            "disk-full",
            Message(
                "the disk has {free:.1f} GB free, and the recording needs {size:.1f} GB",
                free=free / 1e9,
                size=(size_bytes + RESERVE_BYTES) / 1e9,
            ),
            Message("free some space, or choose a directory on another disk"),
            bytes=size_bytes,
            free_bytes=free,
        )


async def _write(path: Path, parts: AsyncIterator[bytes]) -> None:
    """Write the parts as they come; what a sender who has gone has sent is written too."""
    piece = bytearray()
    with path.open("wb") as file, contextlib.suppress(ClientDisconnect):
        async for part in parts:
            piece += part
            if len(piece) >= _PIECE_BYTES:
                await asyncio.to_thread(file.write, piece)
                piece = bytearray()
        await asyncio.to_thread(file.write, piece)


def _check_recording(path: Path, size_bytes: int) -> None:
    """ServerError if it is not complete, RecordingError if no reader recognises it; its content is on the disk then."""
    if path.stat().st_size != size_bytes:
        raise ServerError(
            "upload-incomplete",
            Message("the upload of {name} was broken off", name=path.name),
            Message("send it again"),
        )
    open_file(path)
    with path.open("r+b") as file:
        os.fsync(file.fileno())  # here, and not in the thread that serves the pages
