"""Recordings of an archive: where each is, what the lake knows of it, and what tracking it gives."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pyarrow as pa

from livebode.core import LEVELS, ArchiveError, LivebodeError
from livebode.dataclass import dataclass
from livebode.locations import Location, find, location, with_originals
from livebode_plant.archive.archive_settings import Template
from livebode_plant.lake import TABLES, DataFile, Key, Lake


@dataclass(frozen=True)
class RecordingPlace:
    """A recording at one place.

    Attributes
    ----------
    url
        Where it is.
    size_bytes
        Its length; 0 if the storage does not know it.
    version
        A text that changes with the content.
    machine
        Levels of the machine that the place names.
    """

    url: Location
    size_bytes: int
    version: str
    machine: tuple[tuple[str, str], ...] = ()

    @property
    def known_as(self) -> tuple[str, str]:
        """Key of the table `files`."""
        return str(self.url), self.version


@dataclass(frozen=True)
class ArchivedRecording:
    """A recording, and which results of it are to be found.

    Attributes
    ----------
    place
        From which it is read.
    recipes
        Ids of the recipes by which it is tracked; with none it is only hashed.
    content
        Its content; empty if it is not known yet.
    """

    place: RecordingPlace
    recipes: tuple[str, ...] = ()
    content: str = ""

    @property
    def size_bytes(self) -> int:
        """Length of the file."""
        return self.place.size_bytes


def find_places(templates: Iterable[Template]) -> list[RecordingPlace]:
    """The recordings that the inputs of an archive name, each place once, by name.

    Raises
    ------
    ArchiveError
        If there is none.
    LocationError, ExtraError
        If a storage cannot be used.
    """
    places: dict[str, RecordingPlace] = {}
    templates = list(templates)
    for template in templates:
        for file in find(template.pattern):
            url = file.url.absolute() if isinstance(file.url, Path) else file.url
            machine = tuple(template.machine(str(url)).items())
            places.setdefault(str(url), RecordingPlace(url, file.size_bytes or 0, file.version, machine))
    if not places:
        patterns = [template.text for template in templates]
        raise ArchiveError(
            "no-recordings",
            f"no file matches {' or '.join(repr(text) for text in patterns)}",
            "check inputs: * is any name in one directory, ** any number of directories",
            inputs=patterns,
        )
    return [places[name] for name in sorted(places)]


def known_contents(lake: Lake) -> tuple[dict[tuple[str, str], str], dict[int, set[str]]]:
    """Content by place and version, of all places where the lake knows the content; and the contents by length."""
    table = lake.read("files", ["url", "version", "content", "size_bytes"])
    url, version, content, size = (table[name].to_pylist() for name in ("url", "version", "content", "size_bytes"))
    by_size: dict[int, set[str]] = {}
    for digest, size_bytes in zip(content, size):
        by_size.setdefault(size_bytes, set()).add(digest)
    return dict(zip(zip(url, version), content)), by_size


def file_rows(contents: Iterable[tuple[RecordingPlace, str]], machine: dict[str, str]) -> pa.Table:
    """Rows of the table `files`; `machine` has the levels for places that name none."""
    rows = [
        {"url": str(place.url), "size_bytes": place.size_bytes, "version": place.version, "content": content}
        | levels_of(place, machine)
        for place, content in contents
    ]
    return pa.Table.from_pylist(rows, schema=TABLES["files"].schema)


def untracked(
    contents: Iterable[tuple[RecordingPlace, str]], recipes: Iterable[str], skipped: set[tuple[str, ...]]
) -> list[ArchivedRecording]:
    """Each content once, at its first place, with the recipes whose key is not skipped, if there are any."""
    recordings: dict[str, ArchivedRecording] = {}
    recipes = tuple(recipes)
    for place, content in contents:
        missing = tuple(recipe for recipe in recipes if Key(content, recipe) not in skipped)
        if missing:
            recordings.setdefault(content, ArchivedRecording(place, missing, content))
    return longest_first(recordings.values())


def longest_first(recordings: Iterable[ArchivedRecording]) -> list[ArchivedRecording]:
    """Recordings in the order in which they are distributed."""
    return sorted(recordings, key=lambda one: (-one.size_bytes, one.content, str(one.place.url)))


def levels_of(place: RecordingPlace, machine: dict[str, str]) -> dict[str, str | None]:
    """The levels of the machine of a place, with those of `machine` where the place names none."""
    own = machine | dict(place.machine)
    return {level: own.get(level) or None for level in LEVELS}


def place_of(row: dict[str, str]) -> RecordingPlace:
    """The place in a row of the table `quarantine`."""
    machine = tuple((level, row[level]) for level in LEVELS if row[level])
    return RecordingPlace(location(row["url"]), 0, "", machine)


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
        return any(isinstance(result, TrackingFailure) and not result.by_content for result in self.results)


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
    return [result for recording in handled for result in recording.results]


def lost(recording: ArchivedRecording) -> RecordingResults:
    """The results of a recording whose worker ended each time."""
    error = ArchiveError(
        "process-ended",
        "the worker that tracked the recording ended three times, with nothing else in it",
        "please report it with the recording",
    )
    recipes = recording.recipes if recording.content else ("",)
    return RecordingResults(tuple(failed(recording.place, error, recording.content, recipe) for recipe in recipes), 0.0)
