"""The run on several recordings of one machine, one after the other."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from livebode.configuration.axis import NOT_RECORDED, Axis
from livebode.configuration.recording import open_recording
from livebode.core import Block, Channel, Event, RecordingError
from livebode.core.clock import RunClock, moments_by
from livebode.estimation import Tracker
from livebode.estimation.successive import SuccessiveTrackers
from livebode.fitting import RecordingsMean
from livebode.locations import Location, local_copy
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.checks import ChannelCheck
from livebode.preparation.part import configured_part
from livebode.preparation.plan import make_settings
from livebode.preparation.recordings import check_same, realisations
from livebode.records.content import content_sha256
from livebode.runtime.destination import Destination
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.provenance import RecordedSpan, provenance, recorded
from livebode.runtime.recording import Examined, examined
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import Outcome, RunLoop
from livebode.sources import Log
from livebode.sources.recording import located


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
    """Several recordings as one source: the numbers of their samples follow each other, with a gap between them."""

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
        for source, shift in zip(self.sources, self.shifts):
            begins = True
            for block in source.blocks(channels):
                yield replace(block, start=block.start + shift, origin_s=0.0, gap=block.gap or begins)
                begins = False


def run_recordings(axis: Axis, to: Destination, control: RunControl) -> Outcome:
    """Examine each recording as a whole, then track them one after the other."""
    started = time.perf_counter()
    parts = _prepared(axis)
    sources, settings = [part.of.source for part in parts], parts[0].tracker.settings
    starts, differ = [part.first for part in parts], realisations(sources, settings)
    follower = SuccessiveTrackers([part.tracker for part in parts], starts)
    pipeline = replace(
        Pipeline.of(axis, follower, parts[0].log.channels), recordings=RecordingsMean(starts, realisations=differ)
    )
    found = parts[0].of.found | {
        "clock": "relative",
        "phase_slips": sum(part.of.found["phase_slips"] for part in parts),
        "left_out_samples": sum(part.of.found["left_out_samples"] for part in parts),
        "recordings": [_about(part) for part in parts],
        "realisations": differ,
    }
    found.pop("part", None)
    about = {"configuration": axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True), "found": found}
    about |= provenance(axis, [part.sha256 for part in parts])
    date = recorded([_span(part) for part in parts])
    noticed = [_named(event, part) for part in parts for event in part.of.noticed]
    loop = RunLoop(
        SuccessiveRecordings(sources, [part.shift for part in parts]), pipeline, to,
        about=about, started=started, control=control, noticed=noticed, recorded=lambda _: date,
    )  # fmt: skip
    with moments_by(RunClock.of_kind("relative")):
        return loop.run()


def _prepared(axis: Axis) -> list[_Part]:
    parts: list[_Part] = []
    for path in axis.source.logs:
        own = axis.model_copy(update={"source": axis.source.model_copy(update={"log": path})})
        with located(path):
            log = configured_part(own, open_recording(own))
            log = log.naming(list(dict.fromkeys([*axis.signals.named, *axis.monitoring.covariates])))
            settings = make_settings(own, log)
            if parts:
                check_same(parts[0].log, parts[0].tracker.settings, log, settings)
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
    details = event.details | {"recording": name}
    return replace(event, sample=event.sample + part.shift, message=f"in {name}: {event.message}", details=details)
