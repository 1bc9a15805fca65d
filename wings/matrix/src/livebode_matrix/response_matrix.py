"""ResponseMatrix: the matrix of responses from several inputs to several outputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import Axis
from livebode.core import (
    REASONS,
    Block,
    Channel,
    ConfigError,
    Event,
    LivebodeError,
    MatrixResponses,
    PlantKinds,
    SignalError,
    Stage,
    Stateful,
    StatefulBase,
)
from livebode.dataclass import dataclass
from livebode.estimation import nearest_hop, quarter_hop
from livebode.fitting import MatrixDriftTest, matrix_with_drift
from livebode.preparation import LIVE_RESPONSES_PER_S, check_length, chosen_part, is_timed
from livebode.records import MATRIX_TABLES
from livebode.runtime import (
    SEEN_AGAIN_BYTES,
    Destination,
    Document,
    Estimate,
    ExaminedRecording,
    Outcome,
    Readiness,
    RunContext,
    check_channels,
    counts_and_speed,
    dated,
    drift_events,
    of_drift,
    of_log,
    of_source,
    versions,
)
from livebode.sources import Log
from livebode.sources.live import LiveSource
from livebode_matrix.configuration import matrix_lines, matrix_settings
from livebode_matrix.detection import MatrixDetection, matrix_detection
from livebode_matrix.settings import MatrixSettings
from livebode_matrix.tracker import MatrixTracker


class MatrixColumns(StatefulBase):
    """Counts of each column over a run.

    Parameters
    ----------
    inputs
        Names of the inputs.
    lines
        Number of lines.
    """

    _stage = Stage("matrix-columns", 1)
    _STATE = ("_counts", "_newest", "_condition")

    def __init__(self, inputs: Sequence[str], lines: int) -> None:
        self._inputs = tuple(inputs)
        self._counts = np.zeros((len(inputs), len(REASONS)), dtype=np.int64)
        self._newest = np.zeros((len(inputs), lines), dtype=np.int64)
        self._condition = np.full(lines, np.nan)

    @property
    def _identity(self) -> str:
        return repr((self._inputs, len(self._condition)))

    @property
    def valid(self) -> int:
        """Number of valid values: columns at lines of responses."""
        return int(self._counts[:, 0].sum())

    def add(self, responses: MatrixResponses) -> None:
        """Count the columns of these responses."""
        if not len(responses):
            return
        for number in range(len(REASONS)):
            self._counts[:, number] += np.count_nonzero(responses.reason == number, axis=(0, 1))
        self._newest = responses.reason[-1].T.astype(np.int64)
        self._condition = responses.condition[-1].copy()

    def summary(self, frequency_hz: np.ndarray) -> dict[str, Any]:
        """Entries of run.json: counts of each column, and the newest invalid lines and worst condition.

        Parameters
        ----------
        frequency_hz
            Frequencies of the lines.
        """
        columns = []
        for name, counts, newest in zip(self._inputs, self._counts, self._newest):
            reasons = {REASONS[i]: int(counts[i]) for i in range(1, len(REASONS)) if counts[i]}
            invalid = {REASONS[i]: frequency_hz[newest == i].tolist() for i in range(1, len(REASONS))}
            now = {reason: lines for reason, lines in invalid.items() if lines}
            columns.append({"input": name, "valid": int(counts[0]), "reasons": reasons, "newest_invalid_hz": now})
        summary: dict[str, Any] = {"columns": columns}
        finite = np.flatnonzero(np.isfinite(self._condition))
        if finite.size:
            worst = finite[np.argmax(self._condition[finite])]
            summary["condition"] = {
                "worst": float(self._condition[worst]),
                "frequency_hz": float(frequency_hz[worst]),
            }
        return summary


@dataclass(eq=False)
class ResponseMatrix(Estimate):
    """The matrix of responses of an axis with several inputs or outputs.

    Attributes
    ----------
    tracker
        Turns samples into matrices.
    columns
        Counts where the columns are valid, and why not.
    drift
        Tests whether the machine drifts within a recording.
    newest, drawn
        The newest matrix, and the newest with a valid column, of a row each; at the end of a recording, averages have a
        drift of the machine in their sigma.
    """

    tables: ClassVar = MATRIX_TABLES

    axis: Axis
    tracker: MatrixTracker
    columns: MatrixColumns
    detection: MatrixDetection
    readiness: Readiness | None = None
    drift: MatrixDriftTest | None = None
    newest: MatrixResponses | None = field(default=None, init=False)
    drawn: MatrixResponses | None = field(default=None, init=False)

    @classmethod
    def of(cls, axis: Axis, rate_hz: float, hop: int | None = None) -> Self:
        """The configured tracker for samples of this rate; LivebodeError if it does not fit the axis."""
        tracker = MatrixTracker(matrix_settings(axis, rate_hz, hop))
        settings = tracker.settings
        columns = MatrixColumns(settings.columns, len(settings.lines))
        return cls(axis, tracker, columns, matrix_detection(axis, settings), _readiness(axis, settings))

    @classmethod
    def live(cls, axis: Axis, source: LiveSource) -> Self:
        """For a live source, whose channels and rate are known; LivebodeError if they do not fit."""
        if source.spectra is not None:
            raise ConfigError(
                "needs-samples",
                "a matrix of responses needs samples, but the drive sends spectra",
                "let the drive send samples, or name one channel for each signal",
                key="signals",
            )
        window = matrix_settings(axis, source.rate_hz).lines.window
        estimate = cls.of(axis, source.rate_hz, nearest_hop(window, source.rate_hz / LIVE_RESPONSES_PER_S))
        check_channels(estimate.channels, source)
        return estimate

    @property
    def settings(self) -> MatrixSettings:
        """Settings of the tracker."""
        return self.tracker.settings

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
    def signals(self) -> list[str]:
        return list(self.settings.channels)

    @property
    def reference(self) -> str:
        """The first of the inputs, or of the excitations."""
        settings = self.settings
        return (settings.input if settings.estimator == "direct" else settings.excitation)[0]

    @property
    def counts(self) -> dict[str, int]:
        return self.tracker.counts

    @property
    def parts(self) -> Mapping[str, Stateful]:
        optional: dict[str, Stateful | None] = {"readiness": self.readiness, "drift": self.drift}
        parts: dict[str, Stateful] = {"tracker": self.tracker, "columns": self.columns, "detection": self.detection}
        return parts | {name: part for name, part in optional.items() if part}

    def take_over(self, before: Estimate) -> bool:
        try:
            self.tracker.restore(before.parts["tracker"].snapshot())
        except LivebodeError:
            return False
        if not isinstance(before, ResponseMatrix):
            return True
        if self.readiness and before.readiness and self.readiness.condition == before.readiness.condition:
            self.readiness.take_over(before.readiness)
        if self.axis.monitoring == before.axis.monitoring:
            self.detection.take_over(before.detection)
        return True

    def describe(self, about: Mapping[str, Any], channels: Sequence[Channel]) -> dict[str, Any]:
        facts = about.get("found", {}) | _found(self.settings, channels)
        begun = dict(about) | {"matrix": True, "found": facts, "versions": versions()}
        return begun | (self.compared_with if self.detection.baseline is not None else {})

    def begin(self, run: RunContext) -> None:
        super().begin(run)
        self._units = tuple(map(tuple, _units(self.settings, run.source.channels)))

    def resume(self) -> Iterator[Document]:
        if (record := self.run.recorder.previous()) is not None:
            for responses in record.matrix_batches(SEEN_AGAIN_BYTES):
                self._remember(responses)
                yield responses

    def monitor(self, block: Block) -> Iterator[Event]:
        if self.readiness is not None:
            yield from self.readiness.take(block)
            self.tracker.set_aside(self.readiness.spans)

    def process(self, block: Block) -> MatrixResponses:
        return replace(self.tracker.process(block, self.run.events.append), units=self._units)

    def valid(self, results: MatrixResponses) -> NDArray[np.bool_]:
        return results.valid

    def documents(self, results: MatrixResponses) -> Iterator[Document]:
        self.columns.add(results)
        if self.readiness is not None:
            self.readiness.left_out(results.sample - self.settings.settled_window + 1, results.sample)
        if len(results):
            self._remember(results)
            if self.drift is not None:
                self.drift.add(results)
            yield results
        if (shedding := self.shedding) is not None:
            shedding.monitors()
            if not shedding.to_monitor(results):
                return
        yield from self.detection.process(results)

    def _remember(self, responses: MatrixResponses) -> None:
        if len(responses):
            self.newest = MatrixResponses.join([responses[-1:]])  # a view would keep all rows in memory
        if len(valid := responses.newest()):
            self.drawn = MatrixResponses.join([valid])

    def judge(self) -> Iterable[Document]:
        if self.columns.valid:
            return ()
        settings, samples = self.settings, self.counts["samples"]
        why = "; ".join(self.newest.why()) if self.newest is not None else ""
        if not why:
            raise SignalError(
                "too-short",
                f"the recording has {samples} samples, less than the {settings.cycle} of {settings.count} experiments",
                "record all experiments, or check experiments.number and experiments.dwell_periods",
                samples=samples,
                cycle=settings.cycle,
            )
        raise SignalError(
            "no-valid-response",
            f"none of {self.run.counts.responses} matrices has a valid column: {why}",
            "check [experiments] and the channels in [signals]",
            reason="columns-invalid",
            responses=self.run.counts.responses,
            window=settings.lines.window,
        )

    def summary(self, sample: int, time_s: float) -> tuple[dict[str, Any], list[Event]]:
        feed, lines = self.run.feed, self.settings.lines
        done = self.describe(self.run.about, feed.source.channels) | of_source(feed.live)
        done |= counts_and_speed(self.counts, lines.rate_hz, self.run.counts) | self.monitored()
        done |= self.columns.summary(lines.frequency_hz)
        if self.drift is None:
            return done, []
        done["drift"] = self._drift(self.drift)
        return done, drift_events(done["drift"], sample, time_s)

    def _drift(self, test: MatrixDriftTest) -> dict[str, Any]:
        """Entries of run.json; the matrices of a run that averages get the change of the machine."""
        settings = self.settings
        if settings.average and self.drawn is not None and self.newest is not None:
            same = self.newest.sample[0] == self.drawn.sample[0]
            self.drawn = matrix_with_drift(self.drawn, test.result())
            self.newest = self.drawn if same else self.newest
        frequency_hz = settings.lines.frequency_hz.tolist()
        places = [
            {"frequency_hz": f, "output": output, "input": input}
            for f in frequency_hz
            for output in settings.output
            for input in settings.columns
        ]
        return of_drift(test.result(whole=True), places)

    def outcome(self, directory: Path, summary: dict[str, Any]) -> Outcome:
        return Outcome(directory, summary, matrix=self.newest)


def examined_matrix(axis: Axis, logs: Sequence[Log], to: Destination) -> ExaminedRecording:  # noqa: ARG001
    """A recording, which is tracked at once."""
    (log,) = logs
    log = _part(axis, log)
    hop = None if is_timed(axis) else quarter_hop(matrix_lines(axis, log.rate_hz).window)
    estimate = ResponseMatrix.of(axis, log.rate_hz, hop)
    estimate.drift = matrix_drift_test(estimate.settings)
    log = log.naming(estimate.channels)
    check_length(log.samples, estimate.window)
    return ExaminedRecording(axis, log, estimate, of_log(log), log.clock_kind, dated(log))


def matrix_drift_test(settings: MatrixSettings) -> MatrixDriftTest:
    """The test for a drift of the machine on matrices with these settings."""
    values = len(settings.lines), len(settings.output), len(settings.columns)
    return MatrixDriftTest(values, settings.lines.rate_hz, settings.repetitions)


def _part(axis: Axis, log: Log) -> Log:
    """The part in [source]; its periods count from the first experiment."""
    start = 0 if axis.experiments is None else axis.experiments.start

    def periods_in(part: Log) -> tuple[int, int]:
        return max(part.first, start), matrix_lines(axis, part.rate_hz).window

    return chosen_part(log, axis.source.from_, axis.source.to, 0, periods_in)


def _readiness(axis: Axis, settings: MatrixSettings) -> Readiness | None:
    """The state of the machine, if a channel shows it."""
    window = settings.lines.window
    return None if axis.ready is None else Readiness(axis.ready, window, settings.settled_window - window)


def _found(settings: MatrixSettings, channels: Sequence[Channel]) -> dict[str, Any]:
    """Entries of run.json under `found`: the grid, the signals and the experiments."""
    outputs, inputs = _channels(settings, channels)
    lines = settings.lines
    return {
        "rate_hz": lines.rate_hz,
        "window": lines.window,
        "bins": list(lines.bins),
        "quiet_bins": [],
        "frequency_hz": lines.frequency_hz.tolist(),
        "hop": settings.step,
        "quantity": "plant",
        "unit": "",
        "outputs": list(settings.output),
        "inputs": list(settings.columns),
        "units": _units(settings, channels),
        "kinds_of_entries": [[asdict(PlantKinds.of(o, i)) for i in inputs] for o in outputs],
        "experiments": {
            "number": settings.count,
            "dwell_periods": settings.dwell,
            "settle_periods": settings.settle,
            "start": settings.start,
            "memory": settings.memory,
            "condition_max": settings.condition_max,
        },
    }


def _units(settings: MatrixSettings, channels: Sequence[Channel]) -> list[list[str]]:
    """Unit of each entry, a row for each output; empty where not known."""
    outputs, inputs = _channels(settings, channels)
    return [[f"{o.unit}/({i.unit})" if o.unit and i.unit else "" for i in inputs] for o in outputs]


def _channels(settings: MatrixSettings, channels: Sequence[Channel]) -> tuple[list[Channel], list[Channel]]:
    """Those of the outputs and of the inputs."""
    by_name = {channel.name: channel for channel in channels}
    outputs = [by_name.get(name, Channel(name)) for name in settings.output]
    inputs = [by_name.get(name, Channel(name)) for name in settings.columns]
    return outputs, inputs
