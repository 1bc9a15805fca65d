"""LiveFeed: how the samples of a live source reach the loop of its run: their numbers, clock, losses and backlog."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import nan
from typing import Any

from livebode.core import Block, Emit, Event
from livebode.runtime.clock_relation import ClockRelation
from livebode.runtime.continuing import PreviousRun, StreamPosition
from livebode.runtime.feed import Feed
from livebode.runtime.joining import Steps
from livebode.runtime.recorder import Recorder
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_counts import CAUSES
from livebode.runtime.sender_numbers import SenderNumbers
from livebode.runtime.shedding import LoadShedding
from livebode.runtime.summary import recorded_live
from livebode.runtime.turns import Turn
from livebode.sources.live import LiveBlock, LiveSource


class LiveFeed(Feed):
    """The samples of a live source.

    Parameters
    ----------
    source
        Source of the samples.
    control
        Requests from other threads.
    position
        Where it continues.
    previous
        The run that this one continues.
    relation
        Its clock while it is open.
    """

    def __init__(
        self,
        source: LiveSource,
        control: RunControl,
        position: StreamPosition,
        previous: PreviousRun | None,
        relation: ClockRelation,
    ) -> None:
        super().__init__(source, control, again=False)
        source.has_record = True
        self.live, self.position, self.previous = source, position, previous
        self.shedding, self.record_wait = LoadShedding(source, lambda: control.ended), source.backlog_cause
        self._live, self._load, self._relation = source, self.shedding, relation
        self._numbers, self._ahead = SenderNumbers(), LossesAhead()
        # The arrival of samples from a file or a pipe does not show when they were taken.
        self._paced = source.paced and not source.on_demand

    def blocks(self, channels: Sequence[str]) -> Iterator[Block | None]:
        return self._live.stream(channels, wait_s=0.0)

    def run(self, steps: Steps, recorder: Recorder) -> None:  # noqa: ARG002 - a step waits for it
        turn = Turn(steps)
        self._live.listen(turn.ask)
        turn.run()

    @property
    def asks_commit(self) -> bool:
        return self._live.asks_commit

    def is_due(self, samples: int) -> bool:
        self._live.expect(samples)
        return self._live.has_more

    def resume(self, recorder: Recorder) -> None:
        if recorder.clock:
            self._relation.clock.pieces = list(recorder.clock)
        self._numbers = SenderNumbers.of(recorder.numbering)

    def clock(self, begun: str | None) -> dict[str, Any]:
        pieces = self._relation.clock.pieces
        return {"clock": list(pieces), "recorded": self._date(None, begun)} if pieces else {}

    def add(self, block: Block, begun: str | None, emit: Emit) -> dict[str, Any]:
        found: dict[str, Any] = {}
        if isinstance(block, LiveBlock):
            if self._numbers.take(block):
                found["numbering"] = self._numbers.pieces
            if self._paced and self._relation.take(block, emit):
                found |= self.clock(begun)
        return found

    def events(self, stop: int) -> list[Event]:
        return self._ahead.released(self._live.take_events(), stop)

    def remaining_events(self, stop: int) -> list[Event]:
        return self.events(stop) + self._ahead.finish()

    def load_events(self, sample: int, time_s: float) -> list[Event]:
        return self._load.take_events(sample, time_s)

    def last_events(self, sample: int, time_s: float) -> list[Event]:
        return self._load.finish(sample, time_s)

    def date(self, to_s: float, begun: str | None) -> dict[str, Any] | None:
        return self._date(to_s, begun)

    def _date(self, to_s: float | None, begun: str | None) -> dict[str, Any]:
        """The date, up to the time after the last sample; None while it runs."""
        clock, previous = self._relation.clock, self.previous
        from_s = previous.time_s if previous is not None else clock.pieces[0][0] if clock.pieces else nan
        return recorded_live(clock, from_s, to_s) | ({"from": begun} if begun else {})


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
