"""Detects changes of a run by comparison with a baseline, or reports that it cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

from livebode.configuration import Axis, MonitoringSection
from livebode.core import Block, Event, Parameters, RecordError, Responses, Stage, decode, encode
from livebode.estimation import Settings
from livebode.language import Message

if TYPE_CHECKING:
    from livebode.monitoring import Monitor


_ALARMS = {"change", "change-corrected", "change-cleared", "baseline-unknown", "not-monitored", "places-not-monitored"}
_ALARMS_MAX = 100  # sentences in run.json; events.jsonl has all


class _Judge(Protocol):
    def summary(self) -> dict[str, Any]: ...

    def snapshot(self) -> bytes: ...

    def restore(self, snapshot: bytes) -> None: ...


Compared = TypeVar("Compared", bound=_Judge)


class BaselineComparison(Generic[Compared]):
    """The monitor of a run, if there is one, and its alarms.

    Parameters
    ----------
    monitor
        Judges the results of the run; a stage with a state.
    baseline
        Name of what it compares with.
    remarks
        Sentences after the result.
    baseline_id
        Of the version of the baseline.
    """

    _stage: ClassVar[Stage]
    _no_baseline: ClassVar[Message]

    def __init__(
        self,
        monitor: Compared | None,
        baseline: str | None,
        remarks: Sequence[Message] = (),
        baseline_id: str | None = None,
    ) -> None:
        self._monitor, self._baseline, self._remarks, self._id = monitor, baseline, remarks, baseline_id
        self._alarms: list[str] = []

    @property
    def baseline(self) -> str | None:
        """Name of what it compares with; None if it detects nothing."""
        return None if self._monitor is None else self._baseline

    @property
    def compared_with(self) -> dict[str, Any]:
        """Name and id of the baseline, as in run.json."""
        return {"baseline": self.baseline, "baseline_id": self._id}

    def summary(self, suppressed_s: float = 0.0) -> dict[str, Any]:
        """Entries of run.json of a run that was not assessed for so many seconds, as the machine was not ready."""
        if self._monitor is None:
            return self.compared_with | _with_words([self._no_baseline, *self._remarks])
        found = self._result(self._monitor)
        sentences = [found["message"], *self._remarks]
        if suppressed_s:
            sentences.insert(1, Message("Not assessed for {time:.1f} s: the machine was not ready.", time=suppressed_s))
        return self.compared_with | found | _with_words(sentences) | {"alarms": self._alarms}

    def _result(self, monitor: Compared) -> dict[str, Any]:
        """Its summary, with the result as a sentence."""
        return monitor.summary()

    def snapshot(self) -> bytes:
        """Its messages, and the state that the next event depends on; see `restore`."""
        monitor = {} if self._monitor is None else {"monitor": self._monitor.snapshot()}
        return encode(self._stage, {"alarms": self._alarms} | monitor)

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot with the same baseline; RecordError if it belongs to another one."""
        state = decode(self._stage, snapshot)
        if (self._monitor is None) != ("monitor" not in state):
            raise RecordError(
                "baseline-differs",
                "the run was started with another baseline or none",
                "continue with that one, or choose another directory",
            )
        if self._monitor is not None:
            self._monitor.restore(state["monitor"])
        self._alarms = state["alarms"]

    def _listed(self, events: list[Event]) -> list[Event]:
        if events:
            self._alarms = [*self._alarms, *(e.message for e in events if e.kind in _ALARMS)][:_ALARMS_MAX]
        return events


def _with_words(sentences: Sequence[str]) -> dict[str, Any]:
    """The result as text, and with its facts."""
    message = Message.sentences(sentences)
    return {"message": str(message), "words": message.plain()}


def no_effect(section: MonitoringSection) -> list[Message]:
    """Remark on settings that have no effect without a baseline."""
    days = section.false_alarm_interval_days
    if days == MonitoringSection().false_alarm_interval_days:
        return []
    return [Message("false_alarm_interval_days = {days:g} has no effect without one.", days=days)]


_NOT_FITTED = Message("The baseline's fitted parameters are not judged: the run has no [fit].")
_NO_SAMPLES = Message("The baseline's model of the machine is not used: it needs samples at regular times.")


class ChangeDetection(BaselineComparison["Monitor"]):
    """Passes a run's samples and responses to a Monitor, if there is one, and lists its alarms for run.json."""

    _stage = Stage("change-detection", 1)
    _no_baseline = Message(
        "Without a baseline no change can be detected; `livebode learn` creates one from healthy runs."
    )

    def __init__(
        self,
        monitor: Monitor | None,
        baseline: str | None,
        remarks: Sequence[Message] = (),
        covariates: tuple[str, ...] = (),
        baseline_id: str | None = None,
    ) -> None:
        super().__init__(monitor, baseline, remarks, baseline_id)
        self.covariates = covariates
        """Channels that it needs in addition to those of the follower."""

    @property
    def watched(self) -> tuple[str, ...]:
        """Parameters that it compares, the first one first."""
        return () if self._monitor is None else self._monitor.parameters

    @property
    def active(self) -> bool:
        """Whether a change is active."""
        return self._monitor is not None and self._monitor.active

    @property
    def judges(self) -> bool:
        """Whether it has judged anything yet."""
        return self._monitor is not None and self._monitor.judged > 0

    def deviation(self, name: str) -> float:
        """Newest relative deviation of a parameter from the baseline; NaN where it is not known."""
        return nan if self._monitor is None else self._monitor.deviation(name)

    def take_samples(self, block: Block) -> list[Event]:
        """Monitor the next samples; without this call they are a gap for the Monitor."""
        return [] if self._monitor is None else self._listed(self._monitor.process_samples(block))

    def take_responses(self, responses: Responses, parameters: Parameters | None) -> list[Event]:
        """Monitor the results of the samples."""
        return [] if self._monitor is None else self._listed(self._monitor.process_responses(responses, parameters))

    def finish(self) -> list[Event]:
        """The last events, at the end of the run."""
        return [] if self._monitor is None else self._listed(self._monitor.finish())


def change_detection(axis: Axis, settings: Settings, *, samples: bool = True) -> ChangeDetection:
    """For these settings; BaselineError if the baseline cannot be read or does not fit.

    Without `samples` only its tables are used, because the model of the machine needs samples.
    """
    section = axis.monitoring
    covariates = tuple(section.covariates) if samples else ()
    if section.baseline is None:
        return ChangeDetection(None, None, no_effect(section), covariates)
    from livebode.monitoring import Baseline, Monitor  # with the simulation

    baseline = Baseline.load(section.baseline)
    learned = baseline.id
    baseline.check_covariates(covariates)
    left_out = not samples and baseline.machine is not None
    if not samples:
        baseline = replace(baseline, machine=None, torque=None)
    monitor = Monitor(baseline, settings, 86400 * section.false_alarm_interval_days, corrected=axis.motion is not None)
    blind = axis.fit is None and "parameters" in monitor.tables
    remarks = [_NOT_FITTED] * blind + [_NO_SAMPLES] * left_out
    return ChangeDetection(monitor, str(section.baseline), remarks, baseline.covariates, learned)
