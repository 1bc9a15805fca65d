"""MatrixPipeline: from the samples of an axis with several inputs or outputs to matrices of responses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from livebode.configuration.axis import Axis
from livebode.configuration.matrix import matrix_settings
from livebode.core import ConfigError, Lines, LivebodeError, Stateful
from livebode.estimation.settings import nearest_hop
from livebode.mimo import MatrixSettings, MatrixTracker
from livebode.preparation.plan import LIVE_RESPONSES_PER_S
from livebode.runtime.matrix_columns import MatrixColumns
from livebode.runtime.matrix_detection import MatrixDetection, matrix_detection
from livebode.runtime.pipeline import Pipeline, check_channels
from livebode.runtime.readiness import Readiness
from livebode.runtime.sample_pipeline import SamplePipeline
from livebode.sources.live import LiveSource


@dataclass(frozen=True, eq=False)
class MatrixPipeline:
    """Processing of the samples of an axis to matrices of responses; new, it has no state yet.

    Attributes
    ----------
    axis
        Configuration from which it was created.
    tracker
        Turns samples into matrices.
    columns
        Counts where the columns are valid, and why not.
    detection
        Detects changes of the machine.
    readiness
        Whether the machine is ready, if a channel shows it.
    """

    axis: Axis
    tracker: MatrixTracker
    columns: MatrixColumns
    detection: MatrixDetection
    readiness: Readiness | None = None

    @classmethod
    def of(cls, axis: Axis, rate_hz: float, hop: int | None = None) -> MatrixPipeline:
        """The configured tracker for samples of this rate; LivebodeError if it does not fit the axis."""
        tracker = MatrixTracker(matrix_settings(axis, rate_hz, hop))
        settings = tracker.settings
        columns = MatrixColumns(settings.columns, len(settings.lines))
        return cls(axis, tracker, columns, matrix_detection(axis, settings), _readiness(axis, settings))

    @classmethod
    def live(cls, axis: Axis, source: LiveSource) -> MatrixPipeline:
        """The same for a live source, whose channels and rate are known; LivebodeError if they do not fit."""
        if source.spectra is not None:
            raise ConfigError(
                "needs-samples",
                "a matrix of responses needs samples, but the drive sends spectra",
                "let the drive send samples, or name one channel for each signal",
                key="signals",
            )
        window = matrix_settings(axis, source.rate_hz).lines.window
        pipeline = cls.of(axis, source.rate_hz, nearest_hop(window, source.rate_hz / LIVE_RESPONSES_PER_S))
        check_channels(pipeline.channels, source)
        return pipeline

    @property
    def lines(self) -> Lines:
        """Lines of the responses."""
        return self.tracker.settings.lines

    @property
    def step(self) -> int:
        """Samples between responses."""
        return self.tracker.settings.step

    @property
    def signals(self) -> list[str]:
        """Channels that are correlated."""
        return list(self.tracker.settings.channels)

    @property
    def reference(self) -> str:
        """The first of the inputs, or of the excitations."""
        settings = self.tracker.settings
        return (settings.input if settings.estimator == "direct" else settings.excitation)[0]

    @property
    def channels(self) -> list[str]:
        """All channels in use, each once."""
        ready = [] if self.readiness is None else [self.readiness.condition.channel]
        return list(dict.fromkeys([*self.signals, *ready]))

    @property
    def counts(self) -> dict[str, int]:
        """Counts of the tracker."""
        return self.tracker.counts

    @property
    def parts(self) -> Mapping[str, Stateful]:
        """Stages with a state, by name."""
        ready = {} if self.readiness is None else {"readiness": self.readiness}
        return {"tracker": self.tracker, "columns": self.columns, "detection": self.detection, **ready}

    def take_over(self, before: SamplePipeline) -> bool:
        """Continue with the state of the previous one, if the settings that it depends on are unchanged.

        Returns whether the tracker continues, so that no window is lost; else it begins again.
        """
        try:
            self.tracker.restore(before.parts["tracker"].snapshot())
        except LivebodeError:
            return False
        if not isinstance(before, MatrixPipeline):
            return True
        if self.readiness and before.readiness and self.readiness.condition == before.readiness.condition:
            self.readiness.take_over(before.readiness)
        if self.axis.monitoring == before.axis.monitoring:
            self.detection.take_over(before.detection)
        return True


def _readiness(axis: Axis, settings: MatrixSettings) -> Readiness | None:
    """The state of the machine, if a channel shows it."""
    window = settings.lines.window
    return None if axis.ready is None else Readiness(axis.ready, window, settings.settled_window - window)


def live_pipeline(axis: Axis, source: LiveSource) -> Pipeline | MatrixPipeline:
    """The processing of a live source; LivebodeError if it does not fit the configuration."""
    return MatrixPipeline.live(axis, source) if axis.signals.is_matrix else Pipeline.live(axis, source)
