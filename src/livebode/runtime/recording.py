"""The run on a recording."""

from __future__ import annotations

import time
from dataclasses import replace

from livebode.configuration.axis import Axis
from livebode.core import Event
from livebode.core.clock import RunClock, moments_by
from livebode.estimation import Tracker
from livebode.fitting.drift import DriftTest
from livebode.preparation.aligned import AlignedLog, slip_event, slips_of
from livebode.preparation.early_spikes import early_spikes
from livebode.preparation.plan import make_follower, roles_in_doubt, window_in_doubt
from livebode.preparation.transients import leading_transient, transient_event
from livebode.runtime.destination import Destination
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import Outcome, RunLoop
from livebode.sources import open_log


def run_recording(axis: Axis, to: Destination, control: RunControl) -> Outcome:
    """Examine a recording as a whole, then track it."""
    started = time.perf_counter()
    given = axis.source
    assert given.log is not None
    log = open_log(
        given.log,
        rate_hz=given.rate_hz,
        time=given.time,
        kinds=given.kinds,
        clock=given.clock,
        dbc=given.dbc,
        channels=[axis.signals.output],
    ).listing([name for name in axis.signals.model_dump().values() if name])
    pipeline = Pipeline.of(axis, make_follower(axis, log), log.channels)
    log = log.listing(pipeline.channels)
    settings = pipeline.follower.settings
    noticed = [Event("roles-doubtful", 0, 0.0, message) for message in roles_in_doubt(axis, log, settings)]
    noticed += window_in_doubt(axis, log, settings)
    slips = slips_of(log, settings)
    if slips:
        noticed.append(slip_event(slips, settings))
    source = AlignedLog(log, slips)
    if not axis.tracking.all_periods and axis.motion is None and (transient := leading_transient(source, settings)):
        source = replace(source, first=transient * settings.lines.window)
        noticed.append(transient_event(transient, settings))
    if isinstance(pipeline.follower, Tracker):
        pipeline.follower.know_spikes(early_spikes(source, settings))
    found = {"format": log.format, "rate_from": log.rate_origin, "phase_slips": len(slips)}
    found |= {"left_out_samples": source.first, "clock": log.clock_kind}
    about = {"configuration": axis.model_dump(mode="json", exclude={"serve"}), "found": found}
    if settings.quantity == "plant" and not settings.average:
        pipeline = replace(pipeline, drift=DriftTest(settings.lines))
    loop = RunLoop(
        source, pipeline, to, about=about, segments=axis.record, started=started, control=control, noticed=noticed
    )
    with moments_by(RunClock.of_kind(log.clock_kind)):
        return loop.run()
