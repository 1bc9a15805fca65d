"""A recording or several, examined as a whole before they are tracked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from livebode import estimation, fitting, preparation
from livebode.configuration import Axis, with_log
from livebode.core import Block, Channel, Event, RecordingError
from livebode.dataclass import dataclass
from livebode.estimation import Follower, Settings, Tracker, hum_events, hum_spans
from livebode.language import Message
from livebode.locations import Location, local_copy
from livebode.preparation import (
    AlignedLog,
    ChannelCheck,
    FaultSearch,
    SilencesOfRecording,
    SteadySearch,
    TrendSearch,
    configured_part,
    early_spikes,
    hop_event,
    make_follower,
    make_settings,
    roles_in_doubt,
    slip_event,
    slips_of,
    spikes_event,
    trend_event,
    trend_of,
    window_in_doubt,
    wrap_events,
)
from livebode.records import content_sha256
from livebode.runtime.documents import RunStep
from livebode.runtime.estimate import ExaminedRecording
from livebode.runtime.recorder import Destination
from livebode.runtime.single_response import SingleResponse
from livebode.runtime.summary import RecordedSpan, dated, recorded
from livebode.sources import Log, located


def examined_recordings(axis: Axis, logs: Sequence[Log], to: Destination) -> ExaminedRecording:
    """A recording or several, of which each is examined as a whole; several are tracked one after the other."""
    if len(logs) > 1:
        return _examined_one_by_one(axis, logs)
    (log,) = logs
    if not log.even:
        from livebode.runtime.uneven_recording import examined_uneven

        return examined_uneven(axis, log)
    log = configured_part(axis, log)
    to.announce(RunStep("lines"))
    return examined_recording(axis, log, make_follower(axis, log), to)


def examined_recording(axis: Axis, log: Log, follower: Follower, to: Destination) -> ExaminedRecording:
    """A recording, examined as a whole, and tracked by this follower."""
    log = log.naming(axis.signals.named)
    estimate = SingleResponse.of(axis, follower, log.channels)
    log = log.naming(estimate.channels)  # with the covariates of a baseline
    to.announce(RunStep("examining"))
    of, settings = examined(axis, log, follower), follower.settings
    if settings.quantity == "plant" and (settings.periodic or settings.estimator == "lpm"):
        estimate.drift = fitting.DriftTest(settings.lines)
    return ExaminedRecording(axis, of.source, estimate, of.found, log.clock_kind, dated(log), of.noticed)


@dataclass(frozen=True, eq=False)
class Examined:
    """A recording as it is tracked, events about the whole of it, and entries of run.json."""

    source: AlignedLog
    noticed: list[Event]
    found: dict[str, Any]


def examined(axis: Axis, log: Log, follower: Follower, shift: int = 0) -> Examined:
    """Examine a recording as a whole; the follower leaves out what does not fit, at the file's numbers plus `shift`."""
    settings = follower.settings
    noticed = [Event("roles-doubtful", 0, 0.0, message) for message in roles_in_doubt(axis, log, settings)]
    noticed += window_in_doubt(axis, log, settings) + hop_event(axis, log, settings)
    noticed += wrap_events(log)
    slips = slips_of(log, settings)
    if slips:
        noticed.append(slip_event(slips, settings))
    whole, periods = AlignedLog(log, slips, log.first), None
    if settings.periodic and not axis.tracking.all_periods and axis.motion is None:
        periods = SteadySearch(settings, whole.first)
    of_tracker = _TrackerSearches(axis, settings, whole.first) if isinstance(follower, Tracker) else None
    _search(whole, [*([periods] if periods else []), *(of_tracker.each if of_tracker else [])])
    source, left_out = whole, np.zeros(0, dtype=np.int64)
    if periods is not None:
        kept = periods.finish()
        source, left_out, noticed = replace(source, first=kept.first), kept.left_out, noticed + kept.noticed
    found = {"format": log.format, "rate_from": log.rate_origin, "phase_slips": len(slips)}
    found |= {"left_out_samples": source.first - log.first, "clock": log.clock_kind}
    if log.wraps:
        found["unwrapped"] = {name: wrap.turn for name, wrap in log.wraps.items()}
    if log.is_part:
        found["part"] = {"first": log.first, "stop": log.stop}
    if of_tracker is not None and isinstance(follower, Tracker):
        follower.leave_out(left_out + shift)
        noticed += of_tracker.inform(follower, source, shift)
        found |= of_tracker.found
    return Examined(source, noticed, found)


class _TrackerSearches:
    """What a Tracker knows of a whole recording before it starts: hum, early spikes, trends, faults of sensors."""

    def __init__(self, axis: Axis, settings: Settings, first: int) -> None:
        self._settings, self._first, self._always = settings, first, axis.tracking.trend == "subtract"
        self._silences = SilencesOfRecording(settings, first)
        self._trends = None if axis.tracking.trend == "keep" else TrendSearch(settings, first)
        self._faults = FaultSearch(settings, first) if axis.motion is None else None
        self.found = dict[str, Any]()
        """Entries of run.json."""

    @property
    def each(self) -> list[_Search]:
        """The searches."""
        return [self._silences, *(one for one in (self._trends, self._faults) if one)]

    def inform(self, tracker: Tracker, source: AlignedLog, shift: int) -> list[Event]:
        """Give the tracker what was found, in a recording that begins at its steady state; events about it."""
        settings = self._settings
        spans = hum_spans(self._silences.finish(), settings.lines, average=settings.average)
        tracker.know_hum([span.shifted(shift) for span in spans])
        tracker.know_spikes(early_spikes(source, settings) + shift)
        noticed = hum_events(spans, settings.lines, source.first)
        transient = (source.first - self._first) // settings.lines.window
        if self._faults and (spikes := self._faults.finish(transient)):
            tracker.know_sensor_spikes([one.shifted(shift) for one in spikes])
            self.found["spikes_subtracted"] = [one.channel for one in spikes]
            noticed.append(spikes_event(spikes, source, settings))
        if self._trends is None:
            return noticed
        drifting = self._trends.finish(transient)
        names = self._trends.names if self._always else [one.channel for one in drifting]
        if names:
            tracker.know_trend(trend_of(source, names, settings.lines).shifted(shift))
            self.found["trend_subtracted"] = names
            noticed += [] if self._always else [trend_event(drifting, settings, source.channels, source.first)]
        return noticed


class _Search(Protocol):
    """A search in the samples of a recording."""

    channels: list[str]

    def process(self, block: Block) -> None: ...


def _search(source: AlignedLog, searches: Sequence[_Search]) -> None:
    """Give the whole of a recording to these searches."""
    channels = list(dict.fromkeys(name for search in searches for name in search.channels))
    for block in source.blocks(channels) if channels else ():
        for search in searches:
            search.process(block)


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


def _examined_one_by_one(axis: Axis, logs: Sequence[Log]) -> ExaminedRecording:
    parts = _parts(axis, logs)
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
    if subtracted := list(dict.fromkeys(name for part in parts for name in part.of.found.get("trend_subtracted", ()))):
        found["trend_subtracted"] = subtracted
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


def _parts(axis: Axis, logs: Sequence[Log]) -> list[_Part]:
    """The recordings with their places in the run."""
    parts: list[_Part] = []
    for path, opened in zip(axis.source.logs, logs, strict=True):
        own = with_log(axis, path)
        with located(path):
            log = configured_part(own, opened)
            log = log.naming(list(dict.fromkeys([*axis.signals.named, *axis.monitoring.covariates])))
            settings = make_settings(own, log)
            if parts:
                preparation.check_same(parts[0].log, parts[0].tracker.settings, log, settings)
                settings = parts[0].tracker.settings
            sha256 = _sha256(path, parts)
            parts.append(_part(own, log, sha256, Tracker(settings), parts[-1].stop if parts else 0))
    return parts


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
