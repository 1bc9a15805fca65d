"""MatrixRunLoop: one run with a matrix of responses, from several inputs to several outputs."""

from __future__ import annotations

import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from livebode.analysis.overview import Overview
from livebode.core import Block, Channel, MatrixResponses, PlantKinds, SignalError
from livebode.mimo import MatrixSettings
from livebode.preparation.checks import check_length
from livebode.runtime import summary
from livebode.runtime.destination import Destination
from livebode.runtime.documents import RunStarted
from livebode.runtime.matrix_pipeline import MatrixPipeline
from livebode.runtime.run_loop import Outcome
from livebode.runtime.sample_loop import SampleLoop, Source


class MatrixRunLoop(SampleLoop[Outcome]):
    """One run with a matrix of responses.

    Parameters
    ----------
    source
        Source of the samples.
    pipeline
        Processes the samples.
    to
        Directory and subscribers of the run.
    about, others
        As of a `SampleLoop`.
    """

    def __init__(
        self, source: Source, pipeline: MatrixPipeline, to: Destination, *, about: dict[str, Any], **others: Any
    ) -> None:
        self.pipeline, self._tracker = pipeline, pipeline.tracker
        self._newest: MatrixResponses | None = None
        self._drawn: MatrixResponses | None = None
        self._units = tuple(map(tuple, _units(self._tracker.settings, source.channels)))
        super().__init__(source, pipeline, to, about=about, **others)

    def _describe(self) -> dict[str, Any]:
        settings = self._tracker.settings
        found = self._about.get("found", {}) | _found(settings, self.source.channels)
        begun = dict(self._about) | {"matrix": True, "found": found, "versions": summary.versions()}
        if self.pipeline.detection.baseline is not None:
            begun["monitoring"] = self.pipeline.detection.compared_with
        return begun

    def _announce_start(self, begun: dict[str, Any]) -> None:
        begun = begun | {"monitoring": self.pipeline.detection.compared_with}
        self._stream.announce(RunStarted(self.to.directory, begun, self._control, Overview()))

    def _announce_previous(self) -> None:
        for responses in self._recorder.previous_matrices():
            self._remember(responses)
            self._stream.announce(responses)

    def _compute(self, block: Block) -> list[Block]:
        if (readiness := self.pipeline.readiness) is not None:
            self._stream.publish_all(readiness.take(block))
            self._tracker.set_aside(readiness.spans)
        self._count(block)
        before = time.perf_counter()
        responses = replace(self._tracker.process(block, self._events.append), units=self._units)
        self._counts.take(responses, time.perf_counter() - before)
        self.pipeline.columns.take(responses)
        if readiness is not None:
            readiness.left_out(responses.sample - self._tracker.settings.settled_window + 1, responses.sample)
        if len(responses):
            self._remember(responses)
            self._stream.publish(responses)
        self._monitor(responses)
        return [block]

    def _monitor(self, responses: MatrixResponses) -> None:
        if self._shedding is not None:
            self._shedding.monitors()
            if not self._shedding.to_monitor(responses):
                return
        self._stream.publish_all(self.pipeline.detection.process(responses))

    def _remember(self, responses: MatrixResponses) -> None:
        if len(responses):
            self._newest = MatrixResponses.join([responses[-1:]])  # a view would keep all rows in memory
        if len(valid := responses.newest()):
            self._drawn = MatrixResponses.join([valid])

    def _check_signals(self, block: Block, ready: list[Block]) -> None:
        """A matrix has its reasons in each response."""

    def _judge(self, *, delayed: bool) -> None:  # noqa: ARG002 - no result is delayed
        settings = self._tracker.settings
        self._counts.check.finish()
        check_length(self._tracker.counts["samples"], settings.lines.window)
        if self.pipeline.columns.valid:
            return
        why = "; ".join(self._newest.why()) if self._newest is not None else ""
        if not why:
            raise SignalError(
                "too-short",
                f"the recording has {self._tracker.counts['samples']} samples, less than the {settings.cycle} of "
                f"{settings.count} experiments",
                "record all experiments, or check experiments.number and experiments.dwell_periods",
                samples=self._tracker.counts["samples"],
                cycle=settings.cycle,
            )
        raise SignalError(
            "no-valid-response",
            f"none of {self._counts.responses} matrices has a valid column: {why}",
            "check [experiments] and the channels in [signals]",
            reason="columns-invalid",
            responses=self._counts.responses,
            window=settings.lines.window,
        )

    def _results(self) -> dict[str, Any]:
        done = self._describe() | summary.of_source(self.source)
        done |= summary.done(self._tracker.counts, self._tracker.settings.lines.rate_hz, self._counts)
        suppressed_s = 0.0
        if self.pipeline.readiness is not None:
            done["readiness"] = self.pipeline.readiness.summary(self._tracker.settings.lines.rate_hz)
            suppressed_s = done["readiness"]["suppressed_s"]
        done["monitoring"] = self.pipeline.detection.summary(suppressed_s)
        return done | self.pipeline.columns.summary(self._tracker.settings.lines.frequency_hz)

    def _draw(self, into: Path) -> None:
        if (responses := self._drawn or self._newest) is not None:
            self.to.draw_matrix(responses, into)

    def _outcome(self) -> Outcome:
        return Outcome(self.to.directory, self._done, None, matrix=self._newest)


def _found(settings: MatrixSettings, channels: tuple[Channel, ...]) -> dict[str, Any]:
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


def _units(settings: MatrixSettings, channels: tuple[Channel, ...]) -> list[list[str]]:
    """Unit of each entry, a row for each output; empty where not known."""
    outputs, inputs = _channels(settings, channels)
    return [[f"{o.unit}/({i.unit})" if o.unit and i.unit else "" for i in inputs] for o in outputs]


def _channels(settings: MatrixSettings, channels: tuple[Channel, ...]) -> tuple[list[Channel], list[Channel]]:
    """Those of the outputs and of the inputs."""
    by_name = {channel.name: channel for channel in channels}
    outputs = [by_name.get(name, Channel(name)) for name in settings.output]
    inputs = [by_name.get(name, Channel(name)) for name in settings.columns]
    return outputs, inputs
