"""Detects changes of a run by comparison with a baseline, or reports that it cannot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from livebode.configuration.axis import Axis, MonitoringSection
from livebode.core import Block, Event, Parameters, RecordError, Responses
from livebode.core.state import Stage, decode, encode
from livebode.estimation import Settings

if TYPE_CHECKING:
    from livebode.monitoring import Monitor

_CANNOT_TELL = "Without a baseline no change can be detected; `livebode learn` creates one from healthy runs."
_NOT_FITTED = " The baseline's fitted parameters are not judged: the run has no [fit]."
_NO_SAMPLES = " The baseline's model of the machine is not used: it needs samples, but the drive sends spectra."
_ALARMS = {"change", "change-corrected", "change-cleared", "baseline-unknown"}
_KEPT = 100  # sentences in run.json; events.jsonl has all

_STAGE = Stage("change-detection", 1)

Write = Callable[[Event], None]


class Watching:
    """Passes a run's samples and responses to a Monitor, if there is one, and records its messages."""

    def __init__(
        self, monitor: Monitor | None, baseline: str | None, remark: str = "", covariates: tuple[str, ...] = ()
    ) -> None:
        self._monitor, self._baseline, self._remark = monitor, baseline, remark
        self.covariates = covariates
        """Channels that it needs in addition to those of the follower."""
        self._alarms: list[str] = []

    def over(
        self, blocks: Iterator[Block], write: Write, has_time: Callable[[], bool] = lambda: True
    ) -> Iterator[Block]:
        """The same blocks, each monitored first; those that there is no time for are a gap for the Monitor."""
        for block in blocks:
            if self._monitor is not None and has_time():
                self._publish(self._monitor.process_samples(block), write)
            yield block

    def follow(self, responses: Responses, parameters: Parameters | None, write: Write) -> None:
        """Monitor the results of the samples."""
        if self._monitor is not None:
            self._publish(self._monitor.process_responses(responses, parameters), write)

    def finish(self, write: Write) -> dict[str, Any]:
        """Entries of run.json."""
        if self._monitor is None:
            return {"baseline": None, "message": _CANNOT_TELL + self._remark}
        self._publish(self._monitor.finish(), write)
        found = self._monitor.summary()
        message = {"message": found["message"] + self._remark}
        return {"baseline": self._baseline} | found | message | {"alarms": self._alarms}

    def snapshot(self) -> bytes:
        """Its messages, and the state that the next event depends on; see `restore`."""
        monitor = {} if self._monitor is None else {"monitor": self._monitor}
        return encode(_STAGE, {"alarms": self._alarms} | monitor)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot with the same baseline; RecordError if it belongs to another one."""
        state = decode(_STAGE, snapshot)
        if (self._monitor is None) != ("monitor" not in state):
            raise RecordError(
                "baseline-differs",
                "the run was started with another baseline or none",
                "continue with that one, or choose another directory",
            )
        if self._monitor is not None:
            self._monitor.restore(state["monitor"])
        self._alarms = state["alarms"]

    def _publish(self, events: list[Event], write: Write) -> None:
        for event in events:
            write(event)
        self._alarms = [*self._alarms, *(e.message for e in events if e.kind in _ALARMS)][:_KEPT]


def make_watching(axis: Axis, settings: Settings, *, samples: bool = True) -> Watching:
    """For these settings; BaselineError if the baseline cannot be read or does not fit.

    Without `samples` only its tables are used, because the model of the machine needs samples.
    """
    section = axis.monitoring
    covariates = tuple(section.covariates) if samples else ()
    if section.baseline is None:
        asked = section.false_alarms != MonitoringSection().false_alarms
        remark = f" false_alarms = {section.false_alarms!r} has no effect without one." * asked
        return Watching(None, None, remark, covariates)
    from livebode.monitoring import Baseline, Monitor  # with the simulation

    baseline = Baseline.load(section.baseline)
    baseline.check_covariates(covariates)
    left_out = not samples and baseline.machine is not None
    if left_out:
        baseline = replace(baseline, machine=None)
    monitor = Monitor(baseline, settings, section.false_alarms, corrected=axis.motion is not None)
    blind = axis.fit is None and "parameters" in monitor.tables
    remark = _NOT_FITTED * blind + _NO_SAMPLES * left_out
    return Watching(monitor, str(section.baseline), remark, baseline.covariates)
