"""What tracking a recording gives: its content, a result for each recipe, or why there is none."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from livebode.core import ArchiveError, LivebodeError
from livebode.locations import with_originals
from livebode_plant.archive.recording_places import ArchivedRecording, RecordingPlace
from livebode_plant.lake import DataFile

_STORAGE = ("location", "output")
_LAKE = ("archive.lake-damaged", "archive.lake-unusable", "archive.changed-meanwhile")


@dataclass(frozen=True)
class HashedContent:
    """The content at a place."""

    place: RecordingPlace
    content: str


@dataclass(frozen=True)
class TrackedResult:
    """A result whose files are in the lake's directory, and its rows of `runs` and `quantities`, not committed yet."""

    files: tuple[DataFile, ...]
    run: dict[str, Any]
    quantities: tuple[dict[str, Any], ...]


@dataclass(frozen=True)
class TrackingFailure:
    """A recording that cannot be read or tracked: the code of the error, and its sentence.

    Content and recipe are empty if the recording could not be read, which is no result.
    """

    place: RecordingPlace
    code: str
    sentence: str
    content: str = ""
    recipe: str = ""

    @property
    def by_content(self) -> bool:
        """Whether the content is the reason, so that the same sentence comes each time."""
        return self.code.partition(".")[0] not in ("archive", *_STORAGE)

    @property
    def by_storage(self) -> bool:
        """Whether the storage is the reason, so that it says nothing about the recording."""
        return not self.recipe or self.code.partition(".")[0] in _STORAGE or self.code in _LAKE


Result = HashedContent | TrackedResult | TrackingFailure


@dataclass(frozen=True)
class RecordingResults:
    """All results of one recording, and the time that they took."""

    results: tuple[Result, ...]
    seconds: float

    @property
    def again(self) -> bool:
        """Whether to try again alone: what the content is the reason of has the same result each time."""
        return any(isinstance(one, TrackingFailure) and not one.by_content for one in self.results)


def failed(place: RecordingPlace, error: Exception, content: str = "", recipe: str = "") -> TrackingFailure:
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
    return TrackingFailure(place, error.code, str(with_originals(error)), content, recipe)


def each_result(handled: Iterable[RecordingResults]) -> list[Result]:
    """The results of several recordings."""
    return [result for one in handled for result in one.results]


def lost(recording: ArchivedRecording) -> RecordingResults:
    """The results of a recording whose worker ended each time."""
    error = ArchiveError(
        "process-ended",
        "the worker that tracked the recording ended three times, with nothing else in it",
        "please report it with the recording",
    )
    recipes = recording.recipes if recording.content else ("",)
    return RecordingResults(tuple(failed(recording.place, error, recording.content, recipe) for recipe in recipes), 0.0)
