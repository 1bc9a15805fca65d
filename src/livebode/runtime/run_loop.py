"""RunLoop: one run with responses from one input to one output."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from livebode.analysis.overview import LIVE_VALUES_MAX, Overview
from livebode.core import Block, MatrixResponses, Parameters, Responses
from livebode.estimation import plant_kinds, response_unit
from livebode.fitting import Fit
from livebode.preparation.checks import check_excitation, check_length, check_some_valid
from livebode.runtime import summary
from livebode.runtime.between_event import between_events
from livebode.runtime.destination import Destination
from livebode.runtime.documents import FitResults, RunStarted
from livebode.runtime.drift_event import drift_events
from livebode.runtime.live_checks import LiveChecks
from livebode.runtime.pipeline import Pipeline
from livebode.runtime.sample_loop import SampleLoop, Source
from livebode.sources.live import LiveSource


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a run.

    Attributes
    ----------
    directory
        Its directory.
    summary
        As in run.json.
    overview
        A thinned copy of its responses; None of a matrix run.
    fit
        The newest valid fit.
    matrix
        The newest matrix of a matrix run.
    """

    directory: Path
    summary: dict[str, Any]
    overview: Responses | None
    fit: Fit | None = None
    matrix: MatrixResponses | None = None

    @property
    def responses(self) -> Responses:
        """A thinned copy of its responses; RuntimeError of a matrix run."""
        if self.overview is None:
            raise RuntimeError("a matrix run has no responses of its own: read one entry of its record")
        return self.overview


class RunLoop(SampleLoop[Outcome]):
    """One run with responses from one input to one output, and what is computed from them: fits and alarms.

    Parameters
    ----------
    source
        Source of the samples.
    pipeline
        Processes the samples.
    to
        Directory and subscribers of the run.
    others
        As of a `SampleLoop`.
    """

    def __init__(self, source: Source, pipeline: Pipeline, to: Destination, *, about: dict[str, Any], **others: Any):
        self.pipeline, self._follower = pipeline, pipeline.follower
        settings = pipeline.follower.settings
        self._label = _schedule_label(source, settings.schedule)
        self._plant = response_unit(source.channels, settings), plant_kinds(source.channels, settings)
        self._overview = Overview(LIVE_VALUES_MAX) if isinstance(source, LiveSource) else Overview()
        self._newest: Fit | None = None
        self._checks: LiveChecks | None = None
        super().__init__(
            source,
            pipeline,
            to,
            about=about | {"found": about.get("found", {}) | {"schedule": self._label}},
            **others,
        )

    def _describe(self) -> dict[str, Any]:
        begun = summary.begun(self._about, self._follower, *self._plant)
        if (detection := self.pipeline.detection) is not None and detection.baseline is not None:
            begun["monitoring"] = detection.compared_with
        return begun

    def _announce_start(self, begun: dict[str, Any]) -> None:
        if (detection := self.pipeline.detection) is not None:
            begun = begun | {"monitoring": detection.compared_with}
        self._stream.announce(RunStarted(self.to.directory, begun, self._control, self._overview))

    def _announce_previous(self) -> None:
        for responses in self._recorder.previous():
            self._overview.add(responses)
            self._stream.announce(responses)
            if self.pipeline.fits is not None:
                self._stream.announce(FitResults(self.pipeline.fits.process(responses[0:0])[0]))  # sets the lines
        self._checks = self._live_checks()

    def _compute(self, block: Block) -> list[Block]:
        ready = self._ready_parts(block)
        self._monitor_samples(ready)
        responses = self._estimate(block)
        self._record_and_publish(responses)
        return ready

    def _ready_parts(self, block: Block) -> list[Block]:
        """The samples at which the machine is ready; publishes where that begins and ends, before its alarms."""
        readiness = self.pipeline.readiness
        if readiness is None:
            return [block]
        self._stream.publish_all(readiness.take(block))
        self._follower.set_aside(readiness.spans)
        return readiness.condition.parts(block)

    def _monitor_samples(self, ready: list[Block]) -> None:
        detection = self.pipeline.detection
        if detection is not None and (self._shedding is None or self._shedding.monitors()):
            for part in ready:
                self._stream.publish_all(detection.take_samples(part))

    def _estimate(self, block: Block) -> Responses:
        self._count(block)
        before = time.perf_counter()
        responses = self._marked(self._follower.process(block, self._events.append))
        self._counts.take(responses, time.perf_counter() - before)
        return responses

    def _marked(self, responses: Responses) -> Responses:
        return responses if self.pipeline.readiness is None else self.pipeline.readiness.mark(responses)

    def _record_and_publish(self, responses: Responses) -> None:
        """Responses, then of those that are assessed the fits and the alarms."""
        self._overview.add(responses)
        if len(responses):
            self._stream.publish(responses)
        if self.pipeline.readiness is not None:
            responses = responses[responses.ready]
        if self.pipeline.drift is not None:
            self.pipeline.drift.add(responses)
        if self.pipeline.recordings is not None:
            self.pipeline.recordings.add(responses)
        parameters = self._fit(responses)
        detection = self.pipeline.detection
        if detection is not None and (self._shedding is None or self._shedding.to_monitor(responses)):
            self._stream.publish_all(detection.take_responses(responses, parameters))

    def _fit(self, responses: Responses) -> Parameters | None:
        fits = self.pipeline.fits
        if fits is None:
            return None
        if self._shedding is None:
            parts, events = fits.process(responses)
        else:
            with self._shedding.fitting(responses) as chosen:
                parts, events = fits.process(chosen)
        self._stream.publish(FitResults(parts))
        self._stream.publish_all(events)
        return parts[0]

    def _check_signals(self, block: Block, ready: list[Block]) -> None:
        if self._checks is not None:
            self._publish_findings(self._checks.take_ready(block, ready))

    def _live_checks(self) -> LiveChecks | None:
        axis, source = self.pipeline.axis, self.source
        if not isinstance(source, LiveSource) or source.spectra is not None or axis is None:
            return None
        counts, settings = self._counts, self._follower.settings
        # After a valid response, the excitation has already begun.
        begins = not (counts.judged or counts.valid_lines or self._previous is not None)
        transient = begins and not (axis.tracking.all_periods or axis.motion)
        channels = self.pipeline.channels
        return LiveChecks(
            settings,
            channels,
            roles=not counts.judged,
            transient=transient,
            judged=counts.judge,
            phase=self._recorder.phase,
        )

    def _judge(self, *, delayed: bool) -> None:
        follower, counts = self._follower, self._counts
        if self._checks is not None:
            self._publish_findings(self._checks.finish())
        counts.check.finish()
        check_length(follower.counts["samples"], follower.settings.lines.window)
        if delayed and counts.handed_out != counts.stop:
            before = time.perf_counter()
            if (responses := follower.finish(self._events.append)) is not None:
                responses = self._marked(responses)
                counts.take(responses, time.perf_counter() - before)
                self._record_and_publish(responses)
            self._report_events()
            counts.handed_out = counts.stop
        check_excitation(follower, counts.check.variance)
        check_some_valid(counts.responses, counts.valid_lines, follower)

    def _results(self) -> dict[str, Any]:
        fits, detection = self.pipeline.fits, self.pipeline.detection
        done = summary.begun(self._about, self._follower, *self._plant)
        done |= summary.done(self._follower.counts, self._follower.settings.lines.rate_hz, self._counts)
        self._newest = None if fits is None else fits.newest()
        seen = self._overview.responses()
        done |= summary.of_source(self.source) | summary.fitted(fits, self._newest, seen[seen.ready])
        suppressed_s = 0.0
        if self.pipeline.readiness is not None:
            done["readiness"] = self.pipeline.readiness.summary(self._follower.settings.lines.rate_hz)
            suppressed_s = done["readiness"]["suppressed_s"]
        if detection is not None:
            self._stream.publish_all(detection.finish())
            done["monitoring"] = detection.summary(suppressed_s)
        if self.pipeline.drift is not None:
            found = self.pipeline.drift.result()
            done["drift"] = summary.of_drift(found, self._follower.settings.lines)
            self._stream.publish_all(drift_events(done["drift"], *self.position))
        if self.pipeline.recordings is not None:
            done["between"] = summary.of_recordings(self.pipeline.recordings)
            self._stream.publish_all(between_events(done["between"], *self.position))
        return done

    def _draw(self, into: Path) -> None:
        responses = self._overview.responses()
        if len(responses):
            self.to.draw(responses, into, self._label, self._newest)

    def _outcome(self) -> Outcome:
        return Outcome(self.to.directory, self._done, self._overview.responses(), self._newest)


def _schedule_label(source: Source, name: str | None) -> str:
    unit = next((channel.unit for channel in source.channels if channel.name == name), "")
    return f"{name} in {unit}" if name and unit else name or ""
