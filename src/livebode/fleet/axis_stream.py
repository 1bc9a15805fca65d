"""AxisStream: the messages of one axis in the order of the log become its responses and events."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any, NamedTuple

from livebode.configuration.axis import Axis
from livebode.configuration.recipe import recipe_id
from livebode.core import Event, LivebodeError, Responses, SourceError
from livebode.core.state import Stage, StatefulBase
from livebode.estimation.stream_estimator import Follower
from livebode.fleet.message import read_message
from livebode.preparation.plan import live_follower
from livebode.sources.live import LiveBlock, Sequencer
from livebode.sources.live.joined import joined
from livebode.sources.live.source_events import SourceEvents

RESPONSE_BYTES = 130
"""Of a response at a line, in a message of results."""
_OUTPUT_BYTES_MAX = 4 << 20
"""Most bytes of the responses to one message: a message of results must have room for them."""
_EVENT_BYTES = 1000
_FAILURE_LETTERS_MAX = 1000
_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Output:
    """What messages of the log gave.

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


class _Taken(NamedTuple):
    """Messages that are tracked together: number in the log of the last one, its last sample and time, their Blocks,
    and the most bytes of their responses; more than allowed only for a single message."""

    position: int
    end: tuple[int, float]
    blocks: list[LiveBlock]
    size_bytes: int


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
        self._taken: list[_Taken] = []
        self._responses: list[Responses] = []
        self._tracked_events: list[Event] = []

    @property
    def lost(self) -> int:
        """Samples known to be lost."""
        return self._sequencer.lost

    def process(self, message: bytes, position: int, log_s: float) -> Output:
        """The responses and events of the next message; `position` is its number in the log, `log_s` its time there."""
        self.take(message, position, log_s)
        return self.output()

    def take(self, message: bytes, position: int, log_s: float) -> int:
        """Take the next message, to be tracked together with those after it: the cost is by call, not by sample.

        Returns the most bytes that it adds to a message of results. The responses are those of `process`, bit for bit.
        """
        self.position, self.log_s = position, log_s
        if self.failure:
            return 0
        before, new = self._events.pending, self._follower is None
        try:
            blocks = self._blocks(message)
            size = self._output_bytes_max(blocks) if blocks else 0
        except Exception as error:  # a fault of one axis must not stop the others of its partition
            self._track()
            self._fail(error)
            return _EVENT_BYTES
        if self._taken and self._taken[-1].size_bytes + size <= _OUTPUT_BYTES_MAX:
            blocks, size = self._taken[-1].blocks + blocks, self._taken.pop().size_bytes + size
        self._taken.append(_Taken(position, self._events.position, blocks, size))
        if new:  # what a follower refuses, it refuses at its first message, without those after it
            self._track()
        return min(size, _OUTPUT_BYTES_MAX) + _EVENT_BYTES * (self._events.pending - before)

    def output(self) -> Output:
        """The responses and events of all messages taken since the last call."""
        self._track()
        first, responses = self.responses, self._responses
        events = self._tracked_events + self._events.take()
        self._responses, self._tracked_events = [], []
        self.responses += sum(map(len, responses))
        joined_responses = responses[0] if len(responses) == 1 else Responses.join(responses) if responses else None
        return Output(first, joined_responses, events)

    def _blocks(self, message: bytes) -> list[LiveBlock]:
        blocks = self._sequencer.poll(self.log_s)
        try:
            batch = read_message(message, self.log_s)
        except SourceError as error:
            self._events.report("malformed", f"message {self.position} of the log was dropped: {error}")
            return blocks
        return blocks + self._sequencer.push(batch.with_kinds(self._axis.source.kinds))

    def _output_bytes_max(self, blocks: list[LiveBlock]) -> int:
        """Most bytes of the responses that these Blocks complete; [motion] delays them by a chunk and a window."""
        if self._follower is None:
            self._follower = live_follower(self._axis, blocks[0].rate_hz, self._sequencer.schema.spectra)
        settings = self._follower.settings
        samples = sum(block.stop - block.start for block in blocks)
        if self._axis.motion is not None:
            samples += round(self._axis.motion.chunk_s * settings.lines.rate_hz) + settings.lines.window
        return (samples // settings.step + len(blocks) + 1) * len(settings.lines) * RESPONSE_BYTES

    def _track(self) -> None:
        taken, self._taken = self._taken, []
        for part in taken:
            found: list[Responses] = []
            if not self.failure:
                try:
                    found += map(self._tracked, joined(part.blocks))
                except Exception as error:
                    self._fail(error)
            if sum(one.value.size for one in found) * RESPONSE_BYTES > _OUTPUT_BYTES_MAX:
                what = f"message {part.position} of the log has too many samples: its responses were dropped"
                self._tracked_events.append(Event("malformed", *part.end, what))
                found = []
            self._responses += [one for one in found if len(one)]

    def _tracked(self, block: LiveBlock) -> Responses:
        assert self._follower is not None
        return self._follower.process(block, self._tracked_events.append)

    def _fail(self, error: Exception) -> None:
        if not isinstance(error, LivebodeError):
            _logger.exception("internal error at message %d of the log", self.position)
        self.failure = (str(error) or type(error).__name__)[:_FAILURE_LETTERS_MAX]
        what = f"the axis is not tracked any more: {self.failure}"
        self._tracked_events.append(Event("axis-failed", *self._events.position, what))

    @property
    def _identity(self) -> str:
        return self.recipe

    def _state(self) -> dict[str, Any]:
        assert not self._taken, "a snapshot between take and output would lack samples"
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
