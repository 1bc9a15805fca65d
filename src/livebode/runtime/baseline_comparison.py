"""Comparison of a run with a baseline, as run.json has it: whatever is compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from livebode.configuration import MonitoringSection
from livebode.core import Event, RecordError, Stage, decode, encode
from livebode.language import Message

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
