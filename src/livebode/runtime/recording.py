"""A recording examined as a whole, before it is tracked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from livebode.configuration import Axis, open_even_or_uneven, with_shared_names
from livebode.core import Event
from livebode.estimation import Follower, Tracker, hum_events, hum_spans
from livebode.fitting import DriftTest
from livebode.preparation import (
    AlignedLog,
    configured_part,
    early_spikes,
    make_follower,
    roles_in_doubt,
    silences,
    slip_event,
    slips_of,
    steady,
    window_in_doubt,
)
from livebode.runtime.destination import Destination
from livebode.runtime.estimate import ExaminedRecording
from livebode.runtime.single_response import SingleResponse
from livebode.runtime.summary import dated
from livebode.sources import Log


def examined_recording(axis: Axis, to: Destination) -> ExaminedRecording:
    """Open a recording, and examine it as a whole."""
    opened = open_even_or_uneven(axis)
    if not opened.even:
        from livebode.runtime.uneven_recording import examined_uneven

        return examined_uneven(axis, opened)
    axis = with_shared_names(axis, opened)
    log = configured_part(axis, opened)
    follower = make_follower(axis, log)
    log = log.naming(axis.signals.named)
    estimate = SingleResponse.of(axis, follower, log.channels)
    log = log.naming(estimate.channels)  # with the covariates of a baseline
    to.prepare()
    of, settings = examined(axis, log, follower), follower.settings
    if settings.quantity == "plant" and settings.periodic and not settings.average:
        estimate.drift = DriftTest(settings.lines)
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
    noticed += window_in_doubt(axis, log, settings)
    slips = slips_of(log, settings)
    if slips:
        noticed.append(slip_event(slips, settings))
    source = whole = AlignedLog(log, slips, log.first)
    if settings.periodic and not axis.tracking.all_periods and axis.motion is None:
        kept = steady(source, settings)
        source, noticed = replace(source, first=kept.first), noticed + kept.noticed
        if kept.left_out.size and isinstance(follower, Tracker):
            follower.leave_out(kept.left_out + shift)
    if isinstance(follower, Tracker):
        spans = hum_spans(silences(whole, settings), settings.lines, average=settings.average)
        noticed += hum_events(spans, settings.lines, source.first)
        follower.know_hum([span.shifted(shift) for span in spans])
        follower.know_spikes(early_spikes(source, settings) + shift)
    found = {"format": log.format, "rate_from": log.rate_origin, "phase_slips": len(slips)}
    found |= {"left_out_samples": source.first - log.first, "clock": log.clock_kind}
    if log.is_part:
        found["part"] = {"first": log.first, "stop": log.stop}
    return Examined(source, noticed, found)
