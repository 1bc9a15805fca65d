"""What a worker does with a recording: hash it, then track it, while it is in memory; a failure touches no other."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from livebode.core import ArchiveError
from livebode.locations import local_copy
from livebode.records import content_sha256
from livebode_plant.archive.job import Job
from livebode_plant.archive.recordings import ArchivedRecording
from livebode_plant.archive.results import Handled, Hashed, Result, failed
from livebode_plant.archive.tracking import track
from livebode_plant.lake import Key


def handle(job: Job, recordings: Sequence[ArchivedRecording], scratch: Path | None = None) -> list[Handled]:
    """Hash and track each recording; files are written, and nothing is committed."""
    return [handle_one(job, recording, scratch) for recording in recordings]


def handle_one(job: Job, recording: ArchivedRecording, scratch: Path | None = None) -> Handled:
    """Hash and track one recording."""
    started = time.perf_counter()
    return Handled(tuple(_results(job, recording, scratch)), time.perf_counter() - started)


def _results(job: Job, recording: ArchivedRecording, scratch: Path | None) -> Iterator[Result]:
    """The content if it was not known, and the result of each recipe."""
    place = recording.place
    try:
        with local_copy(place.url) as path:
            content = content_sha256(path)
            if not recording.content:
                yield Hashed(place, content)
                if job.knows(content):
                    return
            elif content != recording.content:
                raise _changed(place.url)
            for recipe in recording.recipes:
                yield _result(job, recording, path, Key(content, recipe), scratch)
    except Exception as error:
        yield failed(place, error)


def _result(job: Job, recording: ArchivedRecording, path: Path, key: Key, scratch: Path | None) -> Result:
    try:
        found = track(job, recording.place, path, key, scratch)
        if content_sha256(path) != key.content:
            raise _changed(recording.place.url)
    except Exception as error:
        return failed(recording.place, error, *key)
    return found


def _changed(url: object) -> ArchiveError:
    return ArchiveError("changed-meanwhile", f"{url} changed while the archive was tracked", "run it again")
