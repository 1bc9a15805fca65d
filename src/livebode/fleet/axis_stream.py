"""AxisStream: the messages of one axis in the order of the log become its responses and events."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from livebode.configuration.axis import Axis
from livebode.configuration.recipe import recipe_id
from livebode.core import Event, LivebodeError, Responses, SourceError
from livebode.core.state import Stage, StatefulBase
from livebode.estimation.stream_estimator import Follower
from livebode.fleet.message import read_message
from livebode.preparation.plan import live_follower
from livebode.sources.live import LiveBlock, Sequencer
from livebode.sources.live.source_events import SourceEvents

RESPONSE_BYTES = 130
"""Of a response at a line, in a message of results."""
_OUTPUT_BYTES_MAX = 4 << 20
"""Most bytes of the responses to one message: a message of results must have room for them."""
_FAILURE_LETTERS_MAX = 1000
_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Output:
    """What one message of the log gave.

    Attributes
    ----------
    number
        Of the first response, counted from the beginning of the axis's run.
    responses
        None if there are none.
    """

    number: int
    responses: Responses | None
    events: list[Event]


class AxisStream(StatefulBase):
    """Turns the messages of an axis into responses, depending on nothing but these messages.

    Time is that of the log, never of the computer, so that another computer that processes the same messages again
    gets the same bits.

    Parameters
    ----------
    axis
        Its configuration.
    run
        Number in the log of its first message.
    """

    _stage = Stage("fleet-axis", 1)
    _STATE = ("run", "position", "responses", "failure")

    def __init__(self, axis: Axis, run: int) -> None:
        self._axis = axis
        self.recipe = recipe_id(axis)
        self.run = run
        self.position = run - 1
        """Number in the log of the last message that was processed."""
        self.responses = 0
        self.failure = ""
        """Why it is not tracked any more; empty while it is."""
        self.log_s = 0.0
        """Time of the last message by the clock of the log."""
        self._events = SourceEvents(clock=lambda: self.log_s)
        settings = axis.source
        self._sequencer = Sequencer(self._events, reorder=settings.reorder_batches, rate_hz=settings.rate_hz)
        self._follower: Follower | None = None

    @property
    def lost(self) -> int:
        """Samples known to be lost."""
        return self._sequencer.lost

    def process(self, message: bytes, position: int, log_s: float) -> Output:
        """The responses and events of the next message; `position` is its number in the log, `log_s` its time there."""
        self.position, self.log_s = position, log_s
        first = self.responses
        events: list[Event] = []
        responses: list[Responses] = []
        if not self.failure:
            try:
                for block in self._blocks(message):
                    found = self._tracked(block).process(block, events.append)
                    responses += [found] if len(found) else []
            except Exception as error:  # a fault of one axis must not stop the others of its partition
                self._fail(error, events)
        if sum(found.value.size for found in responses) * RESPONSE_BYTES > _OUTPUT_BYTES_MAX:
            what = f"message {position} of the log has too many samples: its responses were dropped"
            sample, time_s = self._events.position
            events.append(Event("malformed", sample, time_s, what))
            responses = []
        self.responses += sum(map(len, responses))
        events += self._events.take()
        return Output(first, Responses.join(responses) if responses else None, events)

    def _blocks(self, message: bytes) -> list[LiveBlock]:
        blocks = self._sequencer.poll(self.log_s)
        try:
            batch = read_message(message, self.log_s)
        except SourceError as error:
            self._events.report("malformed", f"message {self.position} of the log was dropped: {error}")
            return blocks
        return blocks + self._sequencer.push(batch.with_kinds(self._axis.source.kinds))

    def _tracked(self, block: LiveBlock) -> Follower:
        if self._follower is None:
            self._follower = live_follower(self._axis, block.rate_hz, self._sequencer.schema.spectra)
        return self._follower

    def _fail(self, error: Exception, events: list[Event]) -> None:
        if not isinstance(error, LivebodeError):
            _logger.exception("internal error at message %d of the log", self.position)
        self.failure = (str(error) or type(error).__name__)[:_FAILURE_LETTERS_MAX]
        sample, time_s = self._events.position
        events.append(Event("axis-failed", sample, time_s, f"the axis is not tracked any more: {self.failure}"))

    @property
    def _identity(self) -> str:
        return self.recipe

    def _state(self) -> dict[str, Any]:
        follower = {} if self._follower is None else {"follower": self._follower.snapshot()}
        return super()._state() | {"sequencer": self._sequencer.snapshot(), **follower}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._sequencer.restore(state["sequencer"])
        self._follower = None
        if "follower" in state:
            rate_hz = self._sequencer.schema.rate_hz
            assert rate_hz is not None
            self._follower = live_follower(self._axis, rate_hz, self._sequencer.schema.spectra)
            self._follower.restore(state["follower"])
