"""Recordings that a browser sends: streamed to the disk, recognised, and only then in their place."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
from collections.abc import AsyncIterator
from pathlib import Path

from starlette.requests import ClientDisconnect

from livebode.core import ServerError, output_files
from livebode.language import Message
from livebode.sources import open_file
from livebode_start.workspace import Workspace, harmless_name

UPLOAD_BYTES_MAX = 4_000_000_000
"""Largest recording."""
RESERVE_BYTES = 256 << 20
"""Space of the disk that an upload leaves to runs and others."""
UPLOADS_MAX = 4
"""At the same time."""
_PIECE_BYTES = 1 << 20


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
            with output_files(self._workspace.directory, "upload") as partial:
                _check_room(partial, size_bytes)
                await _write(partial / name, parts)
                with self._workspace.short_names(partial):
                    await asyncio.to_thread(_check_recording, partial / name, size_bytes)
                self._workspace.check_free(name)
        finally:
            self._names.discard(name)
        return name


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
            Message("free some space, or start livebode in a directory on another disk"),
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
