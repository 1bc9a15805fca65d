"""Several recordings of one machine, examined as a whole before they are tracked one after the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from livebode import estimation, fitting, preparation
from livebode.configuration import Axis, open_recording, with_shared_names
from livebode.core import Block, Channel, Event, RecordingError
from livebode.estimation import Tracker
from livebode.language import Message
from livebode.locations import Location, local_copy
from livebode.preparation import AlignedLog, ChannelCheck, configured_part, make_settings
from livebode.records import content_sha256
from livebode.runtime.destination import Destination
from livebode.runtime.estimate import ExaminedRecording
from livebode.runtime.recording import Examined, examined, examined_recording
from livebode.runtime.single_response import SingleResponse
from livebode.runtime.summary import RecordedSpan, recorded
from livebode.sources import Log, located


@dataclass(frozen=True, eq=False)
class _Part:
    """A recording in the run, whose sample n has the number n + shift there; `stop` is the number after its last."""

    log: Log
    sha256: str
    of: Examined
    tracker: Tracker
    shift: int
    stop: int

    @property
    def first(self) -> int:
        return self.of.source.first + self.shift


@dataclass(frozen=True, eq=False)
class SuccessiveRecordings:
    """Several recordings as one source: the numbers of their samples follow each other, with a gap between them.

    All have the rate of the first.
    """

    sources: Sequence[AlignedLog]
    shifts: Sequence[int]

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.sources[0].channels

    @property
    def samples(self) -> int | None:
        known = [source.samples for source in self.sources]
        return None if None in known else sum(samples or 0 for samples in known)

    def blocks(self, channels: Sequence[str] | None = None) -> Iterator[Block]:
        """The Blocks of all recordings; their times count from sample 0 of the first one."""
        rate_hz = None
        for source, shift in zip(self.sources, self.shifts):
            begins = True
            for block in source.blocks(channels):
                rate_hz = rate_hz or block.rate_hz
                number, gap = block.start + shift, block.gap or begins
                yield replace(block, rate_hz=rate_hz, start=number, origin_s=0.0, gap=gap)
                begins = False


def examined_recordings(axis: Axis, to: Destination) -> ExaminedRecording:
    """Open a recording or several, and examine each as a whole; several are tracked one after the other."""
    if len(axis.source.logs) == 1:
        return examined_recording(axis, to)
    axis, parts = _prepared(axis)
    sources, settings = [part.of.source for part in parts], parts[0].tracker.settings
    starts, differ = [part.first for part in parts], preparation.realisations(sources, settings)
    estimate = SingleResponse.of(
        axis, estimation.SuccessiveTrackers([part.tracker for part in parts], starts), parts[0].log.channels
    )
    estimate.recordings = fitting.RecordingsMean(starts, realisations=differ)
    found = parts[0].of.found | {
        "clock": "relative",
        "phase_slips": sum(part.of.found["phase_slips"] for part in parts),
        "left_out_samples": sum(part.of.found["left_out_samples"] for part in parts),
        "recordings": [_about(part) for part in parts],
        "realisations": differ,
    }
    found.pop("part", None)
    date = recorded([_span(part) for part in parts])
    return ExaminedRecording(
        axis,
        SuccessiveRecordings(sources, [part.shift for part in parts]),
        estimate,
        found,
        "relative",
        lambda _: date,
        [_named(event, part) for part in parts for event in part.of.noticed],
        [part.sha256 for part in parts],
    )


def _prepared(axis: Axis) -> tuple[Axis, list[_Part]]:
    """The parts, and the axis with names that all recordings have."""
    parts: list[_Part] = []
    for path in axis.source.logs:
        own = axis.model_copy(update={"source": axis.source.model_copy(update={"log": path})})
        with located(path):
            opened = open_recording(own)
            if not parts:
                axis, own = with_shared_names(axis, opened), with_shared_names(own, opened)
            log = configured_part(own, opened)
            log = log.naming(list(dict.fromkeys([*axis.signals.named, *axis.monitoring.covariates])))
            settings = make_settings(own, log)
            if parts:
                preparation.check_same(parts[0].log, parts[0].tracker.settings, log, settings)
                settings = parts[0].tracker.settings
            sha256 = _sha256(path, parts)
            parts.append(_part(own, log, sha256, Tracker(settings), parts[-1].stop if parts else 0))
    return axis, parts


def _sha256(place: Location, before: Sequence[_Part]) -> str:
    """The file's checksum; RecordingError if it is that of an earlier one, which would count as twice the evidence."""
    with local_copy(place) as path:
        found = content_sha256(path)
    same = next((part.log.path for part in before if part.sha256 == found), None)
    if same is not None:
        raise RecordingError(
            "recording-repeated",
            f"{place} has the same content as {same}",
            "give each recording once",
            path=str(place),
            other=str(same),
        )
    return found


def _part(axis: Axis, log: Log, sha256: str, tracker: Tracker, behind: int) -> _Part:
    """The recording with whole periods between it and the number `behind`, so that its phases stay as they are."""
    settings = tracker.settings
    window, names = settings.lines.window, [name for role in settings.roles if (name := settings.channel(role))]
    shift = -(-(behind + window - log.first) // window) * window if behind else 0
    of = examined(axis, log, tracker, shift)
    stop, check = of.source.first, ChannelCheck(tuple(names), settings.channel(settings.method.reference) or "")
    for block in of.source.blocks(list(dict.fromkeys(names))):
        check.take(block)
        stop = block.stop
    check.finish()
    return _Part(log, sha256, of, tracker, shift, stop + shift)


def _about(part: _Part) -> dict[str, Any]:
    """Entry of run.json: the file, its samples in the run and its own, and what was found."""
    left_out, slips = part.of.found["left_out_samples"], part.of.found["phase_slips"]
    return {
        "file": str(part.log.path),
        "sha256": part.sha256,
        "first": part.first,
        "stop": part.stop,
        "first_in_file": part.of.source.first,
        "left_out_samples": left_out,
        "phase_slips": slips,
        "part": part.of.found.get("part"),
    }


def _span(part: _Part) -> RecordedSpan:
    log = part.log
    times = [log.origin_s + sample / log.rate_hz for sample in (log.first, part.stop - part.shift)]
    return RecordedSpan(log.path, log.clock_kind, *times)


def _named(event: Event, part: _Part) -> Event:
    """The event of a recording in the numbers of the run."""
    name = part.log.path.name
    message = Message("in {recording}: {event}", recording=name, event=event)
    return replace(event, sample=event.sample + part.shift, message=message)
