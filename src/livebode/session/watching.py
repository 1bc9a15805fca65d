"""A run's follower that tells changes against a baseline, or says that it cannot."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from livebode.estimation import Settings
from livebode.nouns import Block, Event, Parameters, Responses
from livebode.session.axis import Axis

if TYPE_CHECKING:
    from livebode.monitoring import Monitor

_CANNOT_TELL = "Without a baseline no change can be told; `livebode learn` makes one from healthy runs."
_ALARMS = {"change", "change-cleared", "baseline-unknown"}
_KEPT = 100  # sentences in run.json; events.jsonl has all

Write = Callable[[Event], None]


class Watching:
    """Hands a run's samples and responses to a Monitor, if there is one, and keeps what it says."""

    def __init__(self, monitor: Monitor | None, baseline: str | None) -> None:
        self._monitor, self._baseline = monitor, baseline
        self._alarms: list[str] = []

    def take(self, block: Block, write: Write) -> None:
        """A block of samples."""
        if self._monitor is not None:
            self._publish(self._monitor.process_samples(block), write)

    def follow(self, responses: Responses, parameters: Parameters | None, write: Write) -> None:
        """What became of the samples."""
        if self._monitor is not None:
            self._publish(self._monitor.process_responses(responses, parameters), write)

    def finish(self, write: Write) -> dict[str, Any]:
        """What run.json says of it all."""
        if self._monitor is None:
            return {"baseline": None, "message": _CANNOT_TELL}
        self._publish(self._monitor.finish(), write)
        return {"baseline": self._baseline} | self._monitor.summary() | {"alarms": self._alarms}

    def _publish(self, events: list[Event], write: Write) -> None:
        for event in events:
            write(event)
        self._alarms = [*self._alarms, *(e.message for e in events if e.kind in _ALARMS)][:_KEPT]


def make_watching(axis: Axis, settings: Settings) -> Watching:
    """For these settings; InputError where the baseline cannot be read or does not fit."""
    section = axis.monitoring
    if section.baseline is None:
        return Watching(None, None)
    from livebode.monitoring import Baseline, Monitor  # with the simulation

    monitor = Monitor(
        Baseline.load(section.baseline), settings, section.false_alarms, corrected=axis.motion is not None
    )
    return Watching(monitor, str(section.baseline))
