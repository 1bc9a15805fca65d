"""Contents of run.json: provenance, findings and counts of a run."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.configuration import Axis, recipe_id
from livebode.core import ENCODING, Channel, ClockKind, RunClock, iso_utc
from livebode.dataclass import dataclass
from livebode.estimation import Follower, plant_kinds, response_unit, source_unit
from livebode.kernel import instruction_set
from livebode.locations import Location, local_copy
from livebode.records import content_sha256, joined_sha256
from livebode.runtime.run_counts import RunCounts
from livebode.sources import Log
from livebode.version import __version__

if TYPE_CHECKING:
    from livebode.sources.live import LiveSource


def provenance(axis: Axis, digests: Sequence[str] = ()) -> dict[str, Any]:
    """Entries of run.json that are known at the beginning: machine, recipe, and content of a recording.

    `digests` are those of its files where they are known already.

    Raises
    ------
    RecordingError
        If a file of the configuration cannot be read.
    """
    found: dict[str, Any] = {"recipe": recipe_id(axis)}
    if axis.machine is not None and axis.machine.levels:
        found["machine"] = axis.machine.levels
    if not axis.source.live:
        digests = digests or [_content(place) for place in axis.source.logs]
        files = [{"file": one.name, "sha256": digest} for one, digest in zip(axis.source.logs, digests, strict=True)]
        found["content"] = {"sha256": joined_sha256(digests), "files": files}
    return found


def _content(place: Location) -> str:
    with local_copy(place) as path:
        return content_sha256(path)


@dataclass(frozen=True)
class RecordedSpan:
    """The used part of a recording, in seconds of its own clock."""

    place: Location
    clock: ClockKind
    from_s: float
    to_s: float


def recorded(spans: Sequence[RecordedSpan]) -> dict[str, Any]:
    """Entry ``recorded`` of run.json: date of the recordings, from the first to the last.

    Without a time of day in one of them, it is from the times at which the files were last modified: a recording ends
    there, and is as long as its part that was used. A copy may have lost that time.
    """
    if all(span.clock == "utc" for span in spans):
        dates = [(span.from_s, span.to_s) for span in spans]
        return _entry(min(begin for begin, _ in dates), max(end for _, end in dates), "time of day")
    ends = [_modified_s(span.place) for span in spans]
    begins = [end - (span.to_s - span.from_s) for end, span in zip(ends, spans)]
    return _entry(min(begins), max(ends), "file")


def of_log(log: Log) -> dict[str, Any]:
    """Entries of run.json under `found`: format and clock of a recording, and which part of it was used."""
    found: dict[str, Any] = {"format": log.format, "rate_from": log.rate_origin, "clock": log.clock_kind}
    return found | ({"part": {"first": log.first, "stop": log.stop}} if log.is_part else {})


def dated(log: Log) -> Callable[[float], dict[str, Any]]:
    """Entry ``recorded`` of run.json, from the time after the last sample of the recording."""
    from_s = log.origin_s + log.first / log.rate_hz
    return lambda to_s: recorded([RecordedSpan(log.path, log.clock_kind, from_s, to_s)])


def recorded_live(clock: RunClock, from_s: float, to_s: float | None) -> dict[str, Any]:
    """The same of a live source, in seconds of the run; None for an end that is not known yet."""
    end = None if to_s is None else clock.unix_s(to_s)
    return _entry(clock.unix_s(from_s), end, "time of day" if clock.pieces else "unknown")


def _entry(from_unix_s: float | None, to_unix_s: float | None, clock: str) -> dict[str, Any]:
    begin, end = (None if unix_s is None else iso_utc(unix_s) for unix_s in (from_unix_s, to_unix_s))
    return {"from": begin, "to": end, "clock": clock}


def _modified_s(place: Location) -> float:
    with local_copy(place) as path:
        files = [file for file in path.rglob("*") if file.is_file()] if path.is_dir() else [path]
        return max(file.stat().st_mtime for file in files)


def begun(about: Mapping[str, Any], tracker: Follower, channels: Sequence[Channel]) -> dict[str, Any]:
    """Entries at the beginning: configuration, findings, versions."""
    settings, written = tracker.settings, source_unit(channels, tracker.settings)
    found = tracker.found() | {
        "quantity": settings.quantity,
        "unit": response_unit(channels, settings),
        "source_unit": None if written is None else asdict(written),
        "kinds": asdict(plant_kinds(channels, settings)),
    }
    return dict(about) | {"found": about.get("found", {}) | found, "versions": versions()}


def versions() -> dict[str, str | int]:
    """Versions of livebode, of what its results depend on, and of the encoding of its states."""
    return {
        "livebode": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "instruction_set": instruction_set(),
        "states": ENCODING,
    }


def counts_and_speed(tracked: Mapping[str, int], rate_hz: float, run: RunCounts) -> dict[str, Any]:
    """Entries at the end: counts and speed; `tracked` are the counts of the tracker."""
    counts, run_s = run.counts(tracked), run.run_s
    recorded_s = counts["samples"] / rate_hz
    speed = {
        "recorded_s": recorded_s,
        "run_s": run_s,
        "tracking_s": run.tracked_s,
        "times_real_time": recorded_s / run_s,
        "samples_per_s": counts["samples"] / run.tracked_s,
    }
    counts |= {"responses": run.responses, "invalid_responses": run.invalid}
    return {"counts": counts, "speed": speed}


def of_source(source: LiveSource | None) -> dict[str, Any]:
    """Entries on a live source; none for a recording."""
    if source is None:
        return {}
    return {"source": asdict(source.health) | {"first_sample": source.first_sample}}
