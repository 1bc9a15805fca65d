"""The output-only run on a recording: its modes over time, without an input and without responses."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from livebode.configuration.axis import NOT_RECORDED, Axis
from livebode.configuration.recording import open_recording
from livebode.core import Event, Parameters, SignalError
from livebode.core.clock import RunClock, moments_by
from livebode.output_only import ModeTracker, OutputOnlySettings, Tracks, WindowModes
from livebode.preparation.checks import ChannelCheck, check_length
from livebode.preparation.output_only import output_only_part, output_only_settings
from livebode.runtime.documents import FitResults, Subscriber, TrackerResults
from livebode.runtime.event_groups import EventGroups
from livebode.runtime.mode_summaries import ModeSummaries
from livebode.runtime.provenance import RecordedSpan, provenance, recorded
from livebode.runtime.recorder import Recorder
from livebode.runtime.stream import Stream
from livebode.runtime.summary import versions
from livebode.runtime.whole_record import WholeRecord
from livebode.sources import Log


@dataclass(frozen=True, eq=False)
class OutputOnlyOutcome:
    """Result of an output-only run: its directory, and its summary as in run.json."""

    directory: Path
    summary: dict[str, Any]


def run_output_only(
    axis: Axis,
    directory: Path,
    draw: Callable[[Path], None],
    *,
    force: bool = False,
    subscribers: Sequence[Subscriber] = (),
    record: Recorder | None = None,
) -> OutputOnlyOutcome:
    """Track the modes of a recording from its outputs alone, and write a run directory.

    Parameters
    ----------
    axis
        With [output_only].
    directory
        Of the run; it appears when the run is complete.
    draw
        Called to add pictures, with the directory before it is renamed.
    force
        Replace an earlier run there.
    subscribers
        Each receives the rows of modes, the events and the progress.
    record
        In place of a run directory. `draw` and `force` then have no effect.

    Raises
    ------
    LivebodeError
        For any error in the recording or the configuration; nothing is written then.
    """
    started = time.perf_counter()
    log = output_only_part(axis, open_recording(axis))
    settings = output_only_settings(axis, log)
    log = log.naming([*settings.outputs, *filter(None, [settings.schedule])])
    record = record or WholeRecord(directory, force=force, responses=False)
    with moments_by(RunClock.of_kind(log.clock_kind)), record:
        run = _OutputOnlyRun(axis, log, settings, Stream(record, subscribers, EventGroups()))
        with threadpool_limits(1, user_api="blas"):  # the matrices are small: threads would wait for each other
            run.follow()
        summary = run.summary(started)
        record.finish(summary, draw)
    return OutputOnlyOutcome(directory, summary)


class _OutputOnlyRun:
    def __init__(self, axis: Axis, log: Log, settings: OutputOnlySettings, stream: Stream) -> None:
        self._axis, self._log, self._settings, self._stream = axis, log, settings, stream
        self._tracker, self._tracks = ModeTracker(settings), Tracks(settings.hops)
        self._summaries = ModeSummaries()
        self._check = ChannelCheck(settings.outputs, settings.outputs[0])
        self._windows: dict[str, int] = {}
        self._at, self._from_s = (0, 0.0), log.origin_s + log.first / log.rate_hz
        self._provenance = provenance(axis)

    def follow(self) -> None:
        """Process every Block of the recording."""
        channels = list(dict.fromkeys([*self._settings.outputs, *filter(None, [self._settings.schedule])]))
        for block in self._log.blocks(channels):
            self._check.take(block)
            for window in self._tracker.process(block, self._stream.publish):
                self._take(window)
            self._at = block.stop, block.origin_s + block.stop / block.rate_hz
            total = self._log.samples
            self._stream.announce(TrackerResults(block, self._tracker.counts["samples"], total))
        self._check.finish()
        check_length(self._tracker.counts["samples"], self._settings.window)
        self._publish(self._tracks.finish())
        if not any(self._windows.values()):
            raise SignalError(
                "too-short",
                f"the recording has no window of {self._settings.window} samples with what the filter needs",
                "choose a shorter window, or record more",
                window=self._settings.window,
            )
        self._stream.publish_all(self._summaries.harmonic_events(*self._at))
        if not self._summaries.modes:
            self._stream.publish(Event("no-modes", *self._at, _NO_MODES))
        self._stream.finish_groups()

    def _take(self, window: WindowModes) -> None:
        self._windows[window.status] = self._windows.get(window.status, 0) + 1
        self._publish(self._tracks.take(window))

    def _publish(self, parts: list[Parameters]) -> None:
        if parts:
            self._stream.publish(FitResults(tuple(parts)))
            for part in parts:
                self._summaries.take(part)

    def summary(self, started: float) -> dict[str, Any]:
        """Contents of run.json."""
        log, settings = self._log, self._settings
        found = settings.found() | {"format": log.format, "rate_from": log.rate_origin, "clock": log.clock_kind}
        if log.is_part:
            found["part"] = {"first": log.first, "stop": log.stop}
        run_s, recorded_s = time.perf_counter() - started, self._tracker.counts["samples"] / settings.rate_hz
        return {
            "output_only": True,
            "configuration": self._axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True),
            "found": found,
            **self._provenance,
            "recorded": recorded([RecordedSpan(log.path, log.clock_kind, self._from_s, self._at[1])]),
            "versions": versions(),
            "counts": self._tracker.counts | {"windows": sum(self._windows.values())},
            "windows": self._windows,
            "speed": {"recorded_s": recorded_s, "run_s": run_s, "times_real_time": recorded_s / run_s},
            "modes": self._summaries.modes,
            "harmonics": self._summaries.harmonics,
        }


_NO_MODES = (
    "no mode was found: no pole is repeated by models of several orders; choose a band around the expected frequency, "
    "or a longer window"
)
