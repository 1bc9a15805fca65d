"""Losses of a live source wait until the samples after them are tracked."""

from __future__ import annotations

from livebode.core import Event
from livebode.runtime.event_groups import CAUSES


class LossesAhead:
    """Delays each loss that is reported before the samples after it are recorded.

    A process that is killed in between has recorded only the samples before the loss. The next process detects the same
    loss again, and longer: with both in the record, it would be counted twice.

    Examples
    --------
    >>> ahead, loss = LossesAhead(), Event("loss", 500, 0.5, "100 samples are missing before sample 500")
    >>> ahead.released([loss, Event("connected", 400, 0.4, "connected")], tracked=400)[0].kind
    'connected'
    >>> ahead.released([], tracked=500), ahead.released([], tracked=501) == [loss]
    ([], True)
    """

    def __init__(self) -> None:
        self._held: list[Event] = []

    def released(self, events: list[Event], tracked: int) -> list[Event]:
        """Events that may be recorded when all samples before number `tracked` were tracked."""
        due: list[Event] = []
        held: list[Event] = []
        for event in self._held + events:
            (held if CAUSES.get(event.kind) == "loss" and event.sample >= tracked else due).append(event)
        self._held = held
        return due

    def finish(self) -> list[Event]:
        """The remaining events, at the end of the run."""
        held, self._held = self._held, []
        return held
