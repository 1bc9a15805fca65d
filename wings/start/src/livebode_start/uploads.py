"""Recordings that a browser sends: streamed to the disk, recognised, and only then in their place."""

from __future__ import annotations

import asyncio
import os
import shutil
from collections.abc import AsyncIterator
from pathlib import Path

from starlette.requests import ClientDisconnect

from livebode.core import OutputError, RecordingError, ServerError, output_files
from livebode.language import Message
from livebode.sources import open_file
from livebode_start.workspace import Workspace, harmless_name

UPLOAD_BYTES_MAX = 4 << 30
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
        self._active = 0

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
        if self._active >= UPLOADS_MAX:
            raise ServerError(
                "busy", Message("{count} recordings are being received already", count=UPLOADS_MAX),
                Message("try again in a moment"), limit=UPLOADS_MAX,
            )  # fmt: skip
        self._active += 1
        try:
            return await self._receive(harmless_name(name), size_bytes, parts)
        finally:
            self._active -= 1

    async def _receive(self, name: str, size_bytes: int | None, parts: AsyncIterator[bytes]) -> str:
        self._check_size(size_bytes)
        assert size_bytes is not None
        directory = self._workspace.directory
        with output_files(directory, "upload") as partial:
            self._check_room(size_bytes)
            received = await _write(partial / name, parts)
            if received != size_bytes:
                raise ServerError(
                    "upload-incomplete",
                    Message("{name} ended before its end", name=name),
                    Message("send it again"),
                    bytes=received,
                )
            await asyncio.to_thread(_check_recording, partial / name)
            stored = self._workspace.free_name(name)
            (partial / name).rename(partial / stored)
        return stored

    @staticmethod
    def _check_size(size_bytes: int | None) -> None:
        if size_bytes is None:
            raise ServerError(
                "request-malformed", "the upload has no length", Message("send it with a content-length")
            )
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

    def _check_room(self, size_bytes: int) -> None:
        free = shutil.disk_usage(self._workspace.directory).free
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


async def _write(path: Path, parts: AsyncIterator[bytes]) -> int:
    """Write the parts as they come, synced; return the number of bytes, also if the sender has gone."""
    size, piece = 0, bytearray()
    with path.open("wb") as file:
        try:
            async for part in parts:
                size += len(part)
                piece += part
                if len(piece) >= _PIECE_BYTES:
                    await asyncio.to_thread(file.write, piece)
                    piece = bytearray()
        except ClientDisconnect:
            return size
        await asyncio.to_thread(file.write, piece)
        file.flush()
        await asyncio.to_thread(os.fsync, file.fileno())
    return size


def _check_recording(path: Path) -> None:
    """RecordingError with the name that its owner knows, if no reader recognises it."""
    try:
        open_file(path)
    except (RecordingError, OutputError) as error:
        raise with_name(error, path) from None


def with_name(error: RecordingError | OutputError, path: Path) -> RecordingError | OutputError:
    """The error with the name of the file in place of its path."""
    raise NotImplementedError
