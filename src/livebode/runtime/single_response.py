"""SingleResponse: the response from one input to one output, with fits, margins, alarms and findings on recordings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from livebode import fitting, preparation
from livebode.analysis import LIVE_VALUES_MAX, Overview
from livebode.configuration import Axis
from livebode.core import Block, Channel, Event, LivebodeError, Response, Responses, Stateful
from livebode.dataclass import dataclass
from livebode.estimation import Follower, Settings, plant_kinds
from livebode.language import Message
from livebode.preparation import check_excitation, check_some_valid
from livebode.records import RESPONSE_TABLES
from livebode.runtime import summary
from livebode.runtime.change_detection import ChangeDetection, change_detection
from livebode.runtime.documents import Document, FitResults
from livebode.runtime.drift import drift_events, of_drift
from livebode.runtime.estimate import (
    SEEN_AGAIN_BYTES,
    Estimate,
    Outcome,
    RunContext,
    check_channels,
)

if TYPE_CHECKING:
    from livebode.core import Parameters
    from livebode.fitting import DriftTest, Fit, RecordingsMean
    from livebode.runtime.fits import Fits
    from livebode.runtime.joining import WaitingSpectra
    from livebode.runtime.live_checks import LiveChecks
    from livebode.runtime.readiness import Readiness
    from livebode.sources.live import LiveSource

ROWS_MAX = 8
"""The spectra of a Block with more are not joined with those of other axes: they are together already."""


def of_recordings(mean: RecordingsMean) -> dict[str, Any]:
    """Entries on the scatter between several recordings; at lines where something is not known it is null."""
    found = mean.result()[1]
    of_line = {"noise_sigma": found.noise, "total_sigma": found.total, "distortion": found.distortion}
    of_all = {"chance": found.chance, "distortion_db": found.distortion_db, "noise_db": found.noise_db}
    return {
        "recordings": found.recordings,
        "realisations": mean.realisations,
        "differs": found.differs,
        **{name: value if np.isfinite(value) else None for name, value in of_all.items()},
        **{name: [v if np.isfinite(v) else None for v in values.tolist()] for name, values in of_line.items()},
    }


def between_events(between: Mapping[str, Any], sample: int, time_s: float) -> list[Event]:
    """None, or one event, at the end of the run; `between` as in run.json."""
    count, noise_db = between["recordings"], between["noise_db"]
    noise = Message("not known") if noise_db is None else Message("{level_db:.1f} dB", level_db=noise_db)
    details = {name: between[name] for name in ("recordings", "chance", "distortion_db", "noise_db")}
    found = between["differs"] and between["distortion_db"] is not None
    if between["realisations"]:
        level = Message("not significant")
        if found:
            level = Message("{level_db:.1f} dB", level_db=between["distortion_db"])
        message = Message(
            "best linear approximation of {realisations} realisations: stochastic distortion, relative to the output "
            "at a line, {level}; noise of the mean {noise}",
            realisations=count,
            level=level,
            noise=noise,
        )
        return [Event("best-linear-approximation", sample, time_s, message, details)]
    if not found:
        return []
    message = Message(
        "the {recordings} recordings differ by more than their noise: by {distortion_db:.1f} dB relative to the "
        "output at a line; noise of the mean {noise}; the bound of the mean contains the difference",
        recordings=count,
        distortion_db=between["distortion_db"],
        noise=noise,
    )
    return [Event("recordings-differ", sample, time_s, message, details)]


@dataclass(eq=False)
class SingleResponse(Estimate):
    """The response from one input to one output, and what is computed from it.

    Attributes
    ----------
    follower
        Turns samples into responses.
    fits
        A model fitted to each response, if one is configured.
    drift
        Tests whether the machine drifts within a recording.
    recordings
        The mean of several recordings.
    schedule_label
        The scheduling signal's name with its unit, as soon as it has a run.
    fit
        The newest valid fit, at the end of the run.
    average
        The average of a run that averages, at its end, with a drift of the machine in its sigma.
    """

    tables: ClassVar = RESPONSE_TABLES

    follower: Follower
    fits: Fits | None = None
    detection: ChangeDetection | None = None
    axis: Axis | None = None
    drift: DriftTest | None = None
    recordings: RecordingsMean | None = None
    readiness: Readiness | None = None
    schedule_label: str = field(default="", init=False)
    fit: Fit | None = field(default=None, init=False)
    average: Response | None = field(default=None, init=False)
    _checks: LiveChecks | None = field(default=None, init=False)
    _ready: list[Block] = field(default_factory=list, init=False)

    @classmethod
    def of(cls, axis: Axis, follower: Follower, channels: Sequence[Channel], *, samples: bool = True) -> Self:
        """The configured stages after the follower, with or without `samples`; LivebodeError if one is not possible."""
        settings = follower.settings
        fits = None
        if axis.fit:
            from livebode.runtime.fits import Fits  # loads every model

            fits = Fits.of(axis.fit, settings.loop, plant_kinds(channels, settings))
        detection = change_detection(axis, settings, samples=samples)
        return cls(follower, fits, detection, axis, readiness=_readiness(axis, settings))

    @classmethod
    def live(cls, axis: Axis, source: LiveSource) -> Self:
        """For a live source, whose channels and rate are known; LivebodeError if they do not fit."""
        follower = preparation.live_follower(axis, source.rate_hz, source.spectra)
        estimate = cls.of(axis, follower, source.channels, samples=source.spectra is None)
        check_channels(estimate.channels, source)
        return estimate

    @property
    def settings(self) -> Settings:
        """Settings of the follower."""
        return self.follower.settings

    @property
    def rate_hz(self) -> float:
        return self.settings.lines.rate_hz

    @property
    def window(self) -> int:
        return self.settings.lines.window

    @property
    def step(self) -> int:
        return self.settings.step

    @property
    def reference(self) -> str:
        return self.settings.channel(self.settings.method.reference) or ""

    @property
    def counts(self) -> dict[str, int]:
        return self.follower.counts

    @property
    def signals(self) -> list[str]:
        return [name for role in self.settings.roles if (name := self.settings.channel(role))]

    @property
    def channels(self) -> list[str]:
        schedule = self.settings.schedule
        covariates = self.detection.covariates if self.detection is not None else ()
        ready = [] if self.readiness is None else [self.readiness.condition.channel]
        return list(dict.fromkeys([*self.signals, *([schedule] if schedule else []), *covariates, *ready]))

    @property
    def parts(self) -> Mapping[str, Stateful]:
        optional = {
            "fits": self.fits,
            "detection": self.detection,
            "drift": self.drift,
            "readiness": self.readiness,
        }
        return {"tracker": self.follower} | {name: part for name, part in optional.items() if part}

    def take_over(self, before: Estimate) -> bool:
        try:
            self.follower.restore(before.parts["tracker"].snapshot())
        except LivebodeError:
            return False
        if not isinstance(before, SingleResponse):
            return True
        if self.readiness and before.readiness and self.readiness.condition == before.readiness.condition:
            self.readiness.take_over(before.readiness)
        if self._same(before, "signals", "tracking", "loop", "motion"):
            if self.fits and before.fits and self._same(before, "fit"):
                self.fits.restore(before.fits.snapshot())
            if self.detection and before.detection and self._same(before, "monitoring", "fit"):
                self.detection.restore(before.detection.snapshot())
        return True

    def _same(self, other: SingleResponse, *sections: str) -> bool:
        return all(getattr(self.axis, name) == getattr(other.axis, name) for name in sections)

    def describe(self, about: Mapping[str, Any], channels: Sequence[Channel]) -> dict[str, Any]:
        name = self.settings.schedule
        unit = next((channel.unit for channel in channels if channel.name == name), "")
        self.schedule_label = f"{name} in {unit}" if name and unit else name or ""
        begun = self._described(about, channels)
        if self.detection is not None and self.detection.baseline is not None:
            begun |= self.compared_with
        return begun

    def _described(self, about: Mapping[str, Any], channels: Sequence[Channel]) -> dict[str, Any]:
        found = dict(about.get("found", {})) | {"schedule": self.schedule_label}
        return summary.begun(dict(about) | {"found": found}, self.follower, channels)

    def begin(self, run: RunContext) -> None:
        super().begin(run)
        if run.feed.live is not None:
            self.overview = Overview(LIVE_VALUES_MAX)

    def resume(self) -> Iterator[Document]:
        if (record := self.run.recorder.previous()) is not None:
            newest = record.batches(SEEN_AGAIN_BYTES)
            first = next(newest, None) or record.responses()  # an empty batch contains the lines, unlike no run
            for responses in chain([first], newest):
                self._see(responses)
                yield responses
                if self.fits is not None:
                    yield FitResults(self.fits.process(responses[0:0])[0])  # sets the lines
        self._checks = self._live_checks()

    def _live_checks(self) -> LiveChecks | None:
        axis, source, counts = self.axis, self.run.feed.live, self.run.counts
        if source is None or source.spectra is not None or axis is None:
            return None
        from livebode.runtime.live_checks import LiveChecks

        # After a valid response, the excitation has already begun.
        begins = self.run.feed.previous is None and not (counts.judged or counts.valid_lines)
        transient = begins and not (axis.tracking.all_periods or axis.motion)
        return LiveChecks(
            self.settings,
            self.channels,
            roles=not counts.judged,
            transient=transient,
            trends=axis.tracking.trend != "keep",
            judged=counts.judge,
            phase=self.run.recorder.phase,
        )

    def monitor(self, block: Block) -> Iterator[Event]:
        """Where the machine begins and ends to be ready, before its alarms."""
        ready = [block]
        if self.readiness is not None:
            yield from self.readiness.take(block)
            self.follower.set_aside(self.readiness.spans)
            ready = self.readiness.condition.parts(block)
        self._ready = ready if self._checks is not None else []  # no other use needs the samples any longer
        if self.detection is not None and (self.shedding is None or self.shedding.monitors()):
            for part in ready:
                yield from self.detection.take_samples(part)

    def waiting_spectra(self, block: Block) -> WaitingSpectra | None:
        if self.readiness is not None or len(block) > ROWS_MAX:
            return None
        from livebode.estimation import SpectraTracker
        from livebode.runtime.joining import WaitingSpectra

        if not isinstance(self.follower, SpectraTracker) or (spectra := self.follower.usual(block)) is None:
            return None
        return WaitingSpectra(self.follower, spectra)

    def process(self, block: Block) -> Responses:
        return self._marked(self.follower.process(block, self.events.append))

    def finish(self) -> Responses | None:
        responses = self.follower.finish(self.events.append)
        return None if responses is None else self._marked(responses)

    def _marked(self, responses: Responses) -> Responses:
        return responses if self.readiness is None else self.readiness.mark(responses)

    def valid(self, results: Responses) -> NDArray[np.bool_]:
        return results.valid

    def documents(self, results: Responses) -> Iterator[Document]:
        """Responses, then of those that are assessed the fits and the alarms."""
        responses = results
        self._see(responses)
        if len(responses):
            yield responses
        if self.readiness is not None:
            responses = responses[responses.ready]
        if self.drift is not None:
            self.drift.add(responses)
        if self.recordings is not None:
            self.recordings.add(responses)
        parameters = None
        if self.fits is not None:
            parts, events = self._fitted(self.fits, responses)
            yield FitResults(parts)
            yield from events
            parameters = parts[0]
        shedding = self.shedding
        if self.detection is not None and (shedding is None or shedding.to_monitor(responses)):
            yield from self.detection.take_responses(responses, parameters)

    def _see(self, responses: Responses) -> None:
        """Take responses for the pictures, of the run or of the one that it continues."""
        self.overview.add(responses)
        if self.settings.average:
            self.average = responses.newest() or self.average

    def _average(self) -> Response | None:
        """The result of a run that averages: of several recordings the mean, else the newest one."""
        if self.average is None:
            return None
        if self.recordings is not None:
            return self.recordings.response()[0]
        if self.drift is None:
            return self.average
        return fitting.with_drift(Responses.of(self.average), self.drift.result())[0]

    def _fitted(self, fits: Fits, responses: Responses) -> tuple[tuple[Parameters, ...], list[Event]]:
        if self.shedding is None:
            return fits.process(responses)
        with self.shedding.fitting(responses) as chosen:
            return fits.process(chosen)

    def check(self, block: Block) -> Iterable[Event]:
        return () if self._checks is None else self._checks.take_ready(block, self._ready)

    def last_findings(self) -> Iterable[Event]:
        return () if self._checks is None else self._checks.finish()

    def judge(self) -> Iterable[Document]:
        counts = self.run.counts
        check_excitation(self.follower, counts.check.variance)
        check_some_valid(counts.responses, counts.valid_lines, self.follower)
        return ()

    def summary(self, sample: int, time_s: float) -> tuple[dict[str, Any], list[Event]]:
        feed, lines = self.run.feed, self.settings.lines
        events = [] if self.detection is None else self.detection.finish()
        done = self._described(self.run.about, feed.source.channels)
        done |= summary.counts_and_speed(self.counts, lines.rate_hz, self.run.counts)
        self.fit = None if self.fits is None else self.fits.newest()
        seen = self.overview.responses()
        fitted = {} if self.fits is None else self.fits.entries(self.fit, seen[seen.ready])
        done |= summary.of_source(feed.live) | fitted | self.monitored()
        if self.drift is not None:
            done["drift"] = of_drift(self.drift.result(), [{"frequency_hz": f} for f in lines.frequency_hz.tolist()])
            events += drift_events(done["drift"], sample, time_s)
        if self.recordings is not None:
            done["between"] = of_recordings(self.recordings)
            events += between_events(done["between"], sample, time_s)
        self.average = self._average()
        return done, events

    def outcome(self, directory: Path, summary: dict[str, Any]) -> Outcome:
        return Outcome(directory, summary, self.overview.responses(), self.fit, self.average)


def _readiness(axis: Axis, settings: Settings) -> Readiness | None:
    """The state of the machine, if a channel shows it."""
    condition = axis.ready
    if condition is None:
        return None
    from livebode.runtime.readiness import Readiness

    chunk_s = 0.0 if axis.motion is None else axis.motion.chunk_s
    return Readiness(condition, settings.span, round(chunk_s * settings.lines.rate_hz))
