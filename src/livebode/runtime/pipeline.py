"""Pipeline: processing of the samples of an axis, from the tracker to the alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from livebode.configuration.axis import Axis
from livebode.core import Channel, Lines, LivebodeError, SignalError, Stateful, nearest_name
from livebode.estimation import Settings, plant_kinds
from livebode.estimation.stream_estimator import Follower
from livebode.fitting import RecordingsMean
from livebode.fitting.drift import DriftTest
from livebode.preparation.plan import live_follower
from livebode.runtime.change_detection import ChangeDetection, change_detection
from livebode.runtime.fits import Fits
from livebode.runtime.readiness import Readiness
from livebode.runtime.sample_pipeline import SamplePipeline
from livebode.sources.live import LiveSource


@dataclass(frozen=True, eq=False)
class Pipeline:
    """Processing of the samples of an axis; new, it has no state yet.

    Attributes
    ----------
    axis
        Configuration from which it was created; None if it was assembled in Python.
    follower
        Turns samples into responses.
    fits
        A model fitted to each response, if one is configured.
    detection
        Detects changes, or reports that it cannot.
    drift
        Tests whether the machine drifts within a recording.
    recordings
        The mean of several recordings.
    readiness
        Whether the machine is ready, if a channel shows it.
    """

    follower: Follower
    fits: Fits | None = None
    detection: ChangeDetection | None = None
    axis: Axis | None = None
    drift: DriftTest | None = None
    recordings: RecordingsMean | None = None
    readiness: Readiness | None = None

    @classmethod
    def of(cls, axis: Axis, follower: Follower, channels: Sequence[Channel], *, samples: bool = True) -> Pipeline:
        """The configured stages after the follower, with or without `samples`; LivebodeError if one is not possible."""
        settings = follower.settings
        fits = Fits.of(axis.fit, settings.loop, plant_kinds(channels, settings)) if axis.fit else None
        readiness = _readiness(axis, settings)
        return cls(follower, fits, change_detection(axis, settings, samples=samples), axis, readiness=readiness)

    @classmethod
    def live(cls, axis: Axis, source: LiveSource) -> Pipeline:
        """The same for a live source, whose channels and rate are known; LivebodeError if they do not fit."""
        follower = live_follower(axis, source.rate_hz, source.spectra)
        pipeline = cls.of(axis, follower, source.channels, samples=source.spectra is None)
        check_channels(pipeline.channels, source)
        return pipeline

    @property
    def lines(self) -> Lines:
        """Lines of the responses."""
        return self.follower.settings.lines

    @property
    def step(self) -> int:
        """Samples between responses."""
        return self.follower.settings.step

    @property
    def reference(self) -> str:
        """The channel whose power is that of the excitation."""
        settings = self.follower.settings
        return settings.channel(settings.method.reference) or ""

    @property
    def counts(self) -> dict[str, int]:
        """Counts of the follower."""
        return self.follower.counts

    @property
    def signals(self) -> list[str]:
        """Channels that the follower correlates."""
        settings = self.follower.settings
        return [name for role in settings.roles if (name := settings.channel(role))]

    @property
    def channels(self) -> list[str]:
        """All channels in use, each once."""
        schedule = self.follower.settings.schedule
        covariates = self.detection.covariates if self.detection is not None else ()
        ready = [] if self.readiness is None else [self.readiness.condition.channel]
        return list(dict.fromkeys([*self.signals, *([schedule] if schedule else []), *covariates, *ready]))

    @property
    def parts(self) -> Mapping[str, Stateful]:
        """Stages with a state, by name."""
        optional = {
            "fits": self.fits,
            "detection": self.detection,
            "drift": self.drift,
            "readiness": self.readiness,
        }
        return {"tracker": self.follower} | {name: part for name, part in optional.items() if part}

    def take_over(self, before: SamplePipeline) -> bool:
        """Continue with the state of the previous one, if the settings that it depends on are unchanged.

        Returns whether the follower continues, so that no window is lost; else it begins again.
        """
        try:
            self.follower.restore(before.parts["tracker"].snapshot())
        except LivebodeError:
            return False
        if not isinstance(before, Pipeline):
            return True
        if self.readiness and before.readiness and self.readiness.condition == before.readiness.condition:
            self.readiness.take_over(before.readiness)
        if self._same(before, "signals", "tracking", "loop", "motion"):
            if self.fits and before.fits and self._same(before, "fit"):
                self.fits.restore(before.fits.snapshot())
            if self.detection and before.detection and self._same(before, "monitoring", "fit"):
                self.detection.restore(before.detection.snapshot())
        return True

    def _same(self, other: Pipeline, *sections: str) -> bool:
        return all(getattr(self.axis, name) == getattr(other.axis, name) for name in sections)


def check_channels(used: Sequence[str], source: LiveSource) -> None:
    """SignalError if a live source has not all of these channels."""
    names = [channel.name for channel in source.channels]
    for name in used:
        if name not in names:
            computed = ", and a live source computes no expressions" if set(name) & set("+-*/(") else ""
            raise SignalError(
                "channel-unknown",
                f"there is no channel {name!r}{computed}",
                nearest_name(name, names),
                channel=name,
                allowed=names,
            )


def _readiness(axis: Axis, settings: Settings) -> Readiness | None:
    """The state of the machine, if a channel shows it."""
    condition = axis.ready
    if condition is None:
        return None
    chunk_s = 0.0 if axis.motion is None else axis.motion.chunk_s
    return Readiness(condition, settings.span, round(chunk_s * settings.lines.rate_hz))
