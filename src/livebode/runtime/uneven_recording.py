"""The run on a recording whose channels have clocks of their own, or a clock that jitters."""

from __future__ import annotations

from dataclasses import replace

from livebode.configuration.axis import NOT_RECORDED, Axis
from livebode.core import Event
from livebode.core.clock import RunClock, moments_by
from livebode.estimation.uneven_tracker import UnevenTracker
from livebode.fitting.drift import DriftTest
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.part import configured_part
from livebode.preparation.plan import roles_in_doubt
from livebode.preparation.steady import steady
from livebode.preparation.uneven_grid import uneven_grid
from livebode.preparation.uneven_plan import check_uneven, clock_facts, uneven_event, uneven_settings
from livebode.preparation.uneven_spectra import UnevenSource
from livebode.runtime.destination import Destination
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.provenance import RecordedSpan, provenance, recorded
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import Outcome, RunLoop
from livebode.sources.uneven import UnevenLog


def run_uneven(axis: Axis, log: UnevenLog, to: Destination, control: RunControl, started: float) -> Outcome:
    """Examine the recording, interpolated on a common grid, then track spectra that are fitted at its own times."""
    check_uneven(axis)
    grid, lines = uneven_grid(axis, log)
    settings = uneven_settings(axis, lines)
    part = configured_part(axis, grid)
    assert isinstance(part, UnevenLog)
    values = list(dict.fromkeys([*([settings.schedule] if settings.schedule else []), *_covariates(axis)]))
    source = UnevenSource(part, settings, values, axis.tracking.differenced)
    follower = UnevenTracker(settings, source.layout)
    pipeline = Pipeline.of(axis, follower, source.channels, samples=False)
    signals = [channel.name for channel in source.layout.signals]
    noticed = [uneven_event(part, signals, lines)]
    noticed += [Event("roles-doubtful", 0, 0.0, message) for message in roles_in_doubt(axis, part, settings)]
    if not axis.tracking.all_periods:
        kept = steady(AlignedLog(part, (), part.first), settings)
        source.first, source.left_out, noticed = kept.first, kept.left_out, noticed + kept.noticed
    found = {"format": part.format, "rate_from": part.rate_origin, "phase_slips": 0, "clock": part.clock_kind}
    found |= {"left_out_samples": source.first - part.first, "clocks": clock_facts(part, signals)}
    if part.is_part:
        found["part"] = {"first": part.first, "stop": part.stop}
    about = {"configuration": axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True), "found": found}
    about |= provenance(axis)
    dates = [part.origin_s + sample / part.rate_hz for sample in (part.first, part.stop)]
    date = recorded([RecordedSpan(part.path, part.clock_kind, *dates)])
    if settings.quantity == "plant" and not settings.average:
        pipeline = replace(pipeline, drift=DriftTest(settings.lines))
    loop = RunLoop(
        source, pipeline, to, about=about, segments=axis.record, started=started, control=control, noticed=noticed,
        recorded=lambda _: date,
    )  # fmt: skip
    with moments_by(RunClock.of_kind(part.clock_kind)):
        return loop.run()


def _covariates(axis: Axis) -> tuple[str, ...]:
    """Channels that the baseline depends on, or a later one may."""
    if axis.monitoring.baseline is None:
        return tuple(axis.monitoring.covariates)
    from livebode.monitoring import Baseline  # with the simulation

    return tuple(Baseline.load(axis.monitoring.baseline).covariates)
