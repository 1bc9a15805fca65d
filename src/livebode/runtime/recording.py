"""The run on a recording."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from livebode.configuration.axis import NOT_RECORDED, Axis
from livebode.configuration.recording import open_even_or_uneven
from livebode.core import Event
from livebode.core.clock import RunClock, moments_by
from livebode.estimation import Tracker
from livebode.estimation.stream_estimator import Follower
from livebode.fitting.drift import DriftTest
from livebode.preparation.aligned import AlignedLog, slip_event, slips_of
from livebode.preparation.early_spikes import early_spikes
from livebode.preparation.part import configured_part
from livebode.preparation.plan import make_follower, roles_in_doubt, window_in_doubt
from livebode.preparation.steady import steady
from livebode.runtime.destination import Destination
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.provenance import RecordedSpan, provenance, recorded
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import Outcome, RunLoop
from livebode.runtime.uneven_recording import run_uneven
from livebode.sources import Log
from livebode.sources.uneven import UnevenLog


def run_recording(axis: Axis, to: Destination, control: RunControl) -> Outcome:
    """Examine a recording as a whole, then track it."""
    started = time.perf_counter()
    opened = open_even_or_uneven(axis)
    if isinstance(opened, UnevenLog):
        return run_uneven(axis, opened, to, control, started)
    log = configured_part(axis, opened)
    follower = make_follower(axis, log)
    log = log.naming(axis.signals.named)
    pipeline = Pipeline.of(axis, follower, log.channels)
    log = log.naming(pipeline.channels)  # with the covariates of a baseline
    to.prepare()
    of = examined(axis, log, pipeline.follower)
    settings = pipeline.follower.settings
    about = {"configuration": axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True), "found": of.found}
    about |= provenance(axis)
    if settings.quantity == "plant" and settings.periodic and not settings.average:
        pipeline = replace(pipeline, drift=DriftTest(settings.lines))
    loop = RunLoop(
        of.source, pipeline, to, about=about, segments=axis.record, started=started, control=control,
        noticed=of.noticed, recorded=dated(log),
    )  # fmt: skip
    with moments_by(RunClock.of_kind(log.clock_kind)):
        return loop.run()


def dated(log: Log) -> Callable[[float], dict[str, Any]]:
    """Entry ``recorded`` of run.json, from the time after the last sample of the recording."""
    from_s = log.origin_s + log.first / log.rate_hz
    return lambda to_s: recorded([RecordedSpan(log.path, log.clock_kind, from_s, to_s)])


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
    noticed += window_in_doubt(axis, log, settings)
    slips = slips_of(log, settings)
    if slips:
        noticed.append(slip_event(slips, settings))
    source = AlignedLog(log, slips, log.first)
    if settings.periodic and not axis.tracking.all_periods and axis.motion is None:
        kept = steady(source, settings)
        source, noticed = replace(source, first=kept.first), noticed + kept.noticed
        if kept.left_out.size and isinstance(follower, Tracker):
            follower.leave_out(kept.left_out + shift)
    if isinstance(follower, Tracker):
        follower.know_spikes(early_spikes(source, settings) + shift)
    found = {"format": log.format, "rate_from": log.rate_origin, "phase_slips": len(slips)}
    found |= {"left_out_samples": source.first - log.first, "clock": log.clock_kind}
    if log.is_part:
        found["part"] = {"first": log.first, "stop": log.stop}
    return Examined(source, noticed, found)
