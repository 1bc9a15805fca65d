"""What a worker does: hash or track a group of recordings; a failure of one does not touch the others."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from livebode.archive.recordings import ArchivedRecording, RecordingPlace
from livebode.archive.results import Failed, Hashed, Tracked, failed
from livebode.archive.tracking import Job, track
from livebode.locations import local_copy
from livebode.records.content import content_sha256


def hash_places(places: Sequence[RecordingPlace], scratch: Path | None = None) -> list[Hashed | Failed]:  # noqa: ARG001
    """The content at each place."""
    return [_hashed(place) for place in places]


def track_recordings(
    job: Job, recordings: Sequence[ArchivedRecording], scratch: Path | None = None
) -> list[Tracked | Failed]:
    """Track each recording; the files are written, and nothing is committed."""
    return [track_one(job, recording, scratch) for recording in recordings]


def track_one(job: Job, recording: ArchivedRecording, scratch: Path | None = None) -> Tracked | Failed:
    """Track one recording."""
    started = time.perf_counter()
    try:
        found = track(job, recording, scratch)
    except Exception as error:
        return failed(recording, error, time.perf_counter() - started)
    return Tracked(recording, found.files, found.run, found.quantities, time.perf_counter() - started)


def _hashed(place: RecordingPlace) -> Hashed | Failed:
    started = time.perf_counter()
    try:
        with local_copy(place.url) as path:
            return Hashed(place, content_sha256(path), time.perf_counter() - started)
    except Exception as error:
        return failed(place, error)
