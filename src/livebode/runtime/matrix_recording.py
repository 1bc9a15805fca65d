"""The run on a recording with several inputs or outputs."""

from __future__ import annotations

import time
from typing import Any

from livebode.configuration.axis import NOT_RECORDED, Axis
from livebode.configuration.matrix import matrix_lines
from livebode.configuration.recording import open_recording
from livebode.core.clock import RunClock, moments_by
from livebode.preparation.checks import check_length
from livebode.preparation.part import chosen_part
from livebode.runtime.destination import Destination
from livebode.runtime.matrix_loop import MatrixRunLoop
from livebode.runtime.matrix_pipeline import MatrixPipeline
from livebode.runtime.provenance import provenance
from livebode.runtime.recording import dated
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import Outcome
from livebode.sources import Log


def run_matrix_recording(axis: Axis, to: Destination, control: RunControl) -> Outcome:
    """Track the matrix of responses of a recording."""
    started = time.perf_counter()
    log = _part(axis, open_recording(axis))
    pipeline = MatrixPipeline.of(axis, log.rate_hz)
    log = log.naming(pipeline.channels)
    check_length(log.samples, pipeline.lines.window)
    found: dict[str, Any] = {"format": log.format, "rate_from": log.rate_origin, "clock": log.clock_kind}
    if log.is_part:
        found["part"] = {"first": log.first, "stop": log.stop}
    about = {"configuration": axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True), "found": found}
    about |= provenance(axis)
    loop = MatrixRunLoop(
        log, pipeline, to, about=about, segments=axis.record, started=started, control=control, recorded=dated(log)
    )
    with moments_by(RunClock.of_kind(log.clock_kind)):
        return loop.run()


def _part(axis: Axis, log: Log) -> Log:
    """The part in [source]; its periods count from the first experiment."""
    start = 0 if axis.experiments is None else axis.experiments.start

    def periods_in(part: Log) -> tuple[int, int]:
        return max(part.first, start), matrix_lines(axis, part.rate_hz).window

    return chosen_part(log, axis.source.from_, axis.source.to, 0, periods_in)
