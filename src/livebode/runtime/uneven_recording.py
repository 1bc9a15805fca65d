"""A recording whose channels have clocks of their own, or a clock that jitters, before it is tracked."""

from __future__ import annotations

from livebode.configuration import Axis
from livebode.core import Event
from livebode.estimation import UnevenTracker
from livebode.fitting import DriftTest
from livebode.preparation import (
    AlignedLog,
    UnevenSource,
    check_uneven,
    clock_facts,
    configured_part,
    drifting_channels,
    roles_in_doubt,
    steady,
    trend_event,
    uneven_event,
    uneven_grid,
    uneven_settings,
    unwrapped,
    wrap_events,
)
from livebode.runtime.estimate import ExaminedRecording
from livebode.runtime.single_response import SingleResponse
from livebode.runtime.summary import RecordedSpan, recorded
from livebode.sources import Log, UnevenLog


def examined_uneven(axis: Axis, log: Log) -> ExaminedRecording:
    """Examine the recording, interpolated on a common grid; the spectra are fitted at its own times."""
    check_uneven(axis)
    log = unwrapped(axis, log)
    assert isinstance(log, UnevenLog)
    grid, lines = uneven_grid(axis, log)
    settings = uneven_settings(axis, lines)
    part = configured_part(axis, grid)
    assert isinstance(part, UnevenLog)
    drifting = [] if axis.tracking.trend == "keep" else drifting_channels(part, settings)
    drifting = [one for one in drifting if one.channel not in axis.tracking.differenced]
    differenced = [*axis.tracking.differenced, *(one.channel for one in drifting)]
    values = list(dict.fromkeys([*([settings.schedule] if settings.schedule else []), *_covariates(axis)]))
    source = UnevenSource(part, settings, values, differenced)
    follower = UnevenTracker(settings, source.layout)
    estimate = SingleResponse.of(axis, follower, source.channels, samples=False)
    signals = [channel.name for channel in source.layout.signals]
    noticed = [uneven_event(part, signals, lines)]
    noticed += wrap_events(part)
    if drifting:
        noticed.append(trend_event(drifting, settings, part.channels, part.first, straight=True))
    noticed += [Event("roles-doubtful", 0, 0.0, message) for message in roles_in_doubt(axis, part, settings)]
    if not axis.tracking.all_periods:
        kept = steady(AlignedLog(part, (), part.first), settings)
        source.first, source.left_out, noticed = kept.first, kept.left_out, noticed + kept.noticed
    found = {"format": part.format, "rate_from": part.rate_origin, "phase_slips": 0, "clock": part.clock_kind}
    found |= {"left_out_samples": source.first - part.first, "clocks": clock_facts(part, signals)}
    if part.is_part:
        found["part"] = {"first": part.first, "stop": part.stop}
    dates = [part.origin_s + sample / part.rate_hz for sample in (part.first, part.stop)]
    date = recorded([RecordedSpan(part.path, part.clock_kind, *dates)])
    if settings.quantity == "plant":
        estimate.drift = DriftTest(settings.lines)
    return ExaminedRecording(axis, source, estimate, found, part.clock_kind, lambda _: date, noticed)


def _covariates(axis: Axis) -> tuple[str, ...]:
    """Channels that the baseline depends on, or a later one may."""
    if axis.monitoring.baseline is None:
        return tuple(axis.monitoring.covariates)
    from livebode.monitoring import Baseline  # with the simulation

    return tuple(Baseline.load(axis.monitoring.baseline).covariates)
