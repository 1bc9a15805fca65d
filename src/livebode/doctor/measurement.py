"""Checks of a configuration, its recordings and live sources, and a run."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from livebode.configuration import Axis, open_recordings, with_log
from livebode.core import LivebodeError, counted
from livebode.doctor.arrival import check_arrival
from livebode.doctor.check import Check
from livebode.doctor.subject import Subject
from livebode.locations import Location
from livebode.preparation import ChannelSummary, contents_of
from livebode.runtime import RecordedRun
from livebode.sources.live import make_source


def check_recording(name: str, axis: Axis, path: Location) -> Check:
    """A recording that does not grow is read to its end."""
    facts = {"path": str(path)}
    if isinstance(path, Path):
        if not path.exists():
            return Check(name, "failed", f"there is no recording {path}", "check source.log", facts)
        if not os.access(path, os.R_OK):
            return Check(name, "failed", f"{path} cannot be read", "check its permissions", facts)
    if axis.source.follow:
        return Check(name, "ok", f"{path} can be read", facts=facts)
    signals = axis.signals
    roles = [name for role in ("excitation", "input", "output") for name in signals.listed(role)]
    names = [*roles, signals.schedule, *axis.monitoring.covariates]
    try:
        _, (log,) = open_recordings(with_log(axis, path))
        channels = contents_of(log, list(dict.fromkeys(filter(None, names)))).channels
    except LivebodeError as error:
        return Check.of_error(name, error)
    silent = [_silence(channel) for channel in channels if not channel.minimum < channel.maximum]
    if silent:
        remedy = "check the wiring and the trace of the drive, or name another channel under [signals]"
        return Check(name, "warning", f"{path} can be read, but {' and '.join(silent)}", remedy, facts)
    return Check(name, "ok", f"{path} can be read", facts=facts)


def _silence(channel: ChannelSummary) -> str:
    if channel.minimum > channel.maximum:
        return f"channel {channel.name!r} is empty: none of its samples is a finite number"
    return f"channel {channel.name!r} is constant at {channel.minimum:g}"


SOURCE = "source"
_AT_ONCE = 16


def check_sources(axes: Mapping[str, Axis]) -> list[Check]:
    """A check for each axis; a single one where there is none. A live source that can be reached is listened to."""
    if not axes:
        return [Check(SOURCE, "not applicable", "there is no valid configuration of an axis that still runs")]
    with ThreadPoolExecutor(_AT_ONCE, "livebode doctor") as threads:
        return list(threads.map(_check, axes, axes.values()))


def _check(of: str, axis: Axis) -> Check:
    name, settings = f"{SOURCE} of {of}" if of else SOURCE, axis.source
    try:
        if settings.replay is not None:
            samples = RecordedRun(settings.replay).samples
            return Check(name, "ok", f"{settings.replay} has {counted(samples, 'recorded sample')}")
        if settings.url is None:
            checks = [check_recording(name, axis, path) for path in settings.logs]
            return next((check for check in checks if check.verdict != "ok"), checks[0])
        source = make_source(settings)
        reach = source.reach()
        if reach.verdict == "ok" and source.address.host:
            return check_arrival(name, axis, reach)
        return Check(name, reach.verdict, reach.message, reach.remedy, reach.facts)
    except LivebodeError as error:
        return Check.of_error(name, error)


CONFIGURATION, RUN = "configuration", "run"


def check_configuration(subject: Subject) -> Check:
    """Whether the file is valid."""
    if subject.configuration is None:
        return Check(CONFIGURATION, "not applicable", "no configuration was given")
    if (error := subject.problems.get(CONFIGURATION)) is not None:
        return Check.of_error(CONFIGURATION, error)
    axes = "1 axis" if len(subject.axes) == 1 else f"{len(subject.axes)} axes"
    words = subject.kind.title if subject.kind is not None else axes
    facts = {"path": str(subject.configuration), "axes": list(subject.axes)}
    return Check(CONFIGURATION, "ok", f"{subject.configuration} is valid: {words}", facts=facts)


def check_run(subject: Subject) -> Check:
    """Whether all that the run has recorded can be read."""
    if subject.run_path is None:
        return Check(RUN, "not applicable", "no run was given")
    run = subject.run
    if run is None:
        return Check.of_error(RUN, subject.problems[RUN])
    try:
        if run.is_matrix:
            responses = sum(map(len, run.undamaged(run.matrix_batches())))
        else:
            responses = sum(map(len, run.undamaged(run.batches())))
        events = sum(1 for _ in run.each_event())
    except LivebodeError as error:
        return Check.of_error(RUN, error)
    open_run = "ended; the same command continues it" if run.ended else "being recorded, or ended by a kill"
    state = "finished" if run.finished else open_run
    message = f"{subject.run_path}: {state}; {counted(responses)}, {counted(events, 'event')}"
    facts = {"finished": run.finished, "responses": responses, "events": events, "damages": len(run.damages)}
    if run.damages:
        remedy = "what is damaged is left out, the rest is used; check the disk"
        return Check(RUN, "warning", f"{message}; {run.damages[0].message}", remedy, facts)
    return Check(RUN, "ok", message, facts=facts)
