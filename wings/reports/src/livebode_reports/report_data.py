"""The data of a report, read once from a run directory."""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis import (
    MARGINS,
    LoopReport,
    ModelTest,
    RunMean,
    averaged,
    checked_loop,
    fit_averaged,
    loop_report,
)
from livebode.configuration import FitSection, LoopSection, ReportSection, recorded_configuration, recorded_report
from livebode.core import Gain, LivebodeError, Model, Response, Responses, SourceUnit, date_and_time
from livebode.dataclass import dataclass
from livebode.fitting import Fit
from livebode.language import listed, tr, worded
from livebode.records import RunRecord, source_unit_in
from livebode_reports.acceptance import LimitEvidence, LimitResult, accepted
from livebode_reports.events import EventSummary
from livebode_reports.parameter_track import Track, tracks


@dataclass(frozen=True)
class Extent:
    """How much a run has: number of responses, of those with an invalid line, first and last time at a valid response,
    and the newest sample of them."""

    count: int
    incomplete: int
    spans_s: tuple[float, float]
    sample: int


@dataclass(frozen=True, eq=False, kw_only=True)
class RunData:
    """What the report of any run needs.

    Attributes
    ----------
    run, configuration
        The run and its complete configuration.
    extent
        How much it has.
    event_summary
        Its events.
    header
        The first page and the limits.
    """

    run: RunRecord
    configuration: dict[str, Any]
    extent: Extent
    event_summary: EventSummary
    header: ReportSection = field(default_factory=ReportSection)

    @property
    def title(self) -> str:
        """Name of the recording or source, for titles."""
        source = self.configuration.get("source", {})
        files = recordings(source)
        name = source.get("url", "") if not files else Path(files[0]).name
        if len(files) > 1:
            name = tr("{file} and {count} more", file=name, count=len(files) - 1)
        if "demo" in self.configuration:
            name = tr("simulated belt axis")
        return str(name or self.run.path.name)

    @property
    def samples(self) -> int:
        """Number of tracked samples; of a run that does not contain it (unfinished), up to its last response."""
        counted = self.run.summary.get("counts", {}).get("samples")
        return int(self.extent.sample + 1 if counted is None else counted)

    @property
    def channels(self) -> dict[str, str]:
        """Channel names by their role."""
        signals = self.configuration.get("signals", {})
        return {role: listed(name) if isinstance(name, list) else str(name) for role, name in signals.items()}


@dataclass(frozen=True, eq=False)
class ShownResponse:
    """The mean of a run, its responses over time, and the fitted model, in one unit."""

    mean: Response
    overview: Responses
    model: Model | None


@dataclass(frozen=True, eq=False, kw_only=True)
class ReportData(RunData):
    """The data of a run with one response, or of one entry of a matrix run.

    Attributes
    ----------
    of
        Its mean response.
    fit, fit_words
        The model fitted to the mean and the data of the fit; or None and the reason.
    loop, loop_words
        Margins of the described loop; or None and the reason.
    tracks
        Parameters and margins over the run, by model.
    judged
        The test of the model on independent data, if requested.
    """

    of: RunMean
    fit: Fit | None
    fit_words: str
    loop: LoopReport | None
    loop_words: str
    tracks: dict[str, Track]
    judged: ModelTest | None = None

    @property
    def entry(self) -> str:
        """The entry of a matrix run, "output ← input"; empty of an ordinary run."""
        return entry_title(self.run)

    @cached_property
    def drive_unit(self) -> SourceUnit | None:
        """The unit of pictures and tables if it is that of the drive; None for SI units."""
        return source_unit_in(self.run.found) if self.header.units == "drive" else None

    @cached_property
    def shown(self) -> ShownResponse:
        """What pictures and tables show of the response."""
        mean, overview, fit, unit = self.of.response, self.of.overview, self.fit, self.drive_unit
        if unit is None:
            return ShownResponse(mean, overview, fit)
        model = None if fit is None else Gain(unit.factor) * fit
        return ShownResponse(unit.converted(mean), unit.converted(overview), model)

    @cached_property
    def accepted(self) -> tuple[LimitResult, ...]:
        """The results of the limits."""
        loop = LoopSection.model_validate(self.configuration.get("loop", {})).build(self.of.overview.lines.rate_hz)
        fits = [t for t in self.tracks.values() if t.model != MARGINS] if self.of.moved else []
        return accepted(self.header.limits, LimitEvidence(self.of.response, loop, self.fit, self.loop, fits))

    @property
    def described(self) -> bool:
        """Whether the configuration describes the controllers."""
        return any(name in self.configuration.get("loop", {}) for name in ("velocity", "position", "position_pd"))


def read(
    directory: Path, judged: ModelTest | None = None, header: ReportSection | None = None, entry: str | None = None
) -> ReportData:
    """Read the run, or an entry of a matrix run; `header` replaces the [report] with which it was recorded.

    Raises
    ------
    RecordError, SignalError
        If the directory is not a run, cannot be read, or has no valid response.
    """
    run = RunRecord.open(directory, entry=entry)
    configuration, of = recorded_configuration(run.summary), averaged(run)
    fit, fit_words = _fit(configuration, of)
    loop, loop_words = _loop(run, configuration, of, fit)
    over = tracks(run, of.overview.sample, of.overview.time_s)
    event_summary = EventSummary.of(run.each_event_and_damage())
    own = recorded_report(run.summary) if header is None else header
    return ReportData(
        run=run,
        configuration=configuration,
        extent=Extent(of.count, of.incomplete, of.spans_s, int(of.response.sample)),
        event_summary=event_summary,
        header=own,
        of=of,
        fit=fit,
        fit_words=fit_words,
        loop=loop,
        loop_words=loop_words,
        tracks=over,
        judged=judged,
    )


def entry_title(run: RunRecord) -> str:
    """The entry that a view of a matrix run shows, "output ← input"; empty of an ordinary run."""
    return "" if run.selected is None else " ← ".join(run.selected)


def _fit(configuration: dict[str, Any], of: RunMean) -> tuple[Fit | None, str]:
    if "fit" not in configuration:
        return None, tr("No model was fitted: the run has no [fit] section. Use `livebode fit RUN` to fit one.")
    try:
        fit, words = fit_averaged(of, FitSection.model_validate(configuration["fit"]))
    except LivebodeError as error:
        return None, tr("No model was fitted: {why}.", why=worded(error.words))
    if fit.status == "ok":
        return fit, words
    return None, tr("The fit to {what} was rejected: {why}.", what=worded(words), why=worded(fit.sentence))


def _loop(run: RunRecord, configuration: dict[str, Any], of: RunMean, fit: Fit | None) -> tuple[LoopReport | None, str]:
    section = LoopSection.model_validate(configuration.get("loop", {}))
    described = section.build(of.overview.lines.rate_hz)
    if described.feedback is None:
        return None, tr("No margins: the run's configuration does not describe the loop ([loop]).")
    if fit is None:
        return None, tr("No margins: they need a fitted model, and there is none.")
    try:
        report = loop_report(fit, "the mean", of.overview, described)
        checked = checked_loop(run.path, section, run.selected)
    except LivebodeError as error:
        return None, tr("No margins: {why}.", why=worded(error.words))
    return replace(report, responses=Responses.of(of.response), checked=checked), ""


def recordings(source: dict[str, Any]) -> list[str]:
    """The recordings in a [source]."""
    files = source.get("log") or []
    return files if isinstance(files, list) else [files]


def written(path: Path) -> str:
    """Time at which a file was written; empty if the file does not exist."""
    try:
        return date_and_time(path.stat().st_mtime)
    except OSError:
        return ""


def by_schedule(of: RunMean) -> bool:
    """Whether the response can be plotted over the schedule."""
    return of.moved and bool(np.isfinite(of.overview.schedule).any())
