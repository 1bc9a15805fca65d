"""What a task returns: the content of a recording, its tracked result, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from livebode.archive.recordings import ArchivedRecording, RecordingPlace
from livebode.core import ArchiveError, LivebodeError
from livebode.lake import DataFile
from livebode.locations import with_originals

_STORAGE = ("location", "output")
_LAKE = ("archive.lake-unusable", "archive.changed-meanwhile")


@dataclass(frozen=True)
class Hashed:
    """The content at a place."""

    item: RecordingPlace
    content: str
    seconds: float


@dataclass(frozen=True)
class Tracked:
    """A result whose files are in the lake's directory, and its rows of `runs` and `quantities`, not committed yet."""

    item: ArchivedRecording
    files: tuple[DataFile, ...]
    run: dict[str, Any]
    quantities: tuple[dict[str, Any], ...]
    seconds: float


@dataclass(frozen=True)
class Failed:
    """A recording that cannot be read or tracked: the code of the error, and its sentence."""

    item: RecordingPlace | ArchivedRecording
    code: str
    sentence: str
    seconds: float = 0.0

    @property
    def by_content(self) -> bool:
        """Whether the content is the reason, so that the same sentence comes each time."""
        return self.code.partition(".")[0] not in ("archive", *_STORAGE)

    @property
    def by_storage(self) -> bool:
        """Whether the storage is the reason, so that it says nothing about the recording."""
        return self.code.partition(".")[0] in _STORAGE or self.code in _LAKE


Result = Hashed | Tracked | Failed


def failed(item: RecordingPlace | ArchivedRecording, error: Exception, seconds: float = 0.0) -> Failed:
    """The failure that an exception means."""
    if isinstance(error, MemoryError):
        error = ArchiveError(
            "memory-exceeded",
            "the recording needs more memory than a worker may use",
            "raise cluster.memory_mb, or split the recording",
        )
    elif not isinstance(error, LivebodeError):
        error = ArchiveError(
            "internal", f"internal error ({type(error).__name__}: {error})", "please report it with the recording"
        )
    return Failed(item, error.code, str(with_originals(error)), seconds)
