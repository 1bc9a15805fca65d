"""AxisStream: the messages of one axis in the order of the log become its responses and events."""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import Axis, recipe_id
from livebode.core import (
    Event,
    LivebodeError,
    Parameters,
    Responses,
    SourceError,
    Stage,
    StatefulBase,
    restore_parts,
)
from livebode.language import Message
from livebode.monitoring import places
from livebode.preparation import live_follower
from livebode.runtime import ChangeDetection, SingleResponse
from livebode.sources import DeclaredQuantities
from livebode.sources.live import LiveBlock, Sequencer, SourceEvents, join_blocks
from livebode_plant.fleet.alike_axes import (
    NO_ROWS,
    Fitted,
    Output,
    PendingSpectrum,
    UnfittedOutput,
    UsualSpectra,
    outputs_together,
)
from livebode_plant.fleet.event_limits import EventLimits
from livebode_plant.fleet.main_quantity import MainQuantity, main_quantity, newest_of
from livebode_plant.fleet.message import read_message

RESPONSE_BYTES = 130
"""Size of a response at a line, in a message of results."""
_OUTPUT_BYTES_MAX = 4 << 20
"""Most bytes of the responses to one message: a message of results must have room for them."""
_EVENT_BYTES = 1000
_FAILURE_LETTERS_MAX = 1000
FITS_PER_S = 2.0
"""Fits of an axis."""
_NO_RECIPE = "unreadable"
"""In place of the recipe of an axis whose files cannot be read: the same for every owner."""
_logger = logging.getLogger(f"livebode.{__name__}")


class _MessageGroup(NamedTuple):
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

    _stage = Stage("fleet-axis", 2)
    _STATE = ("run", "position", "responses", "failure", "changes", "changed_s", "log_s", "_fit_period", "_limits")

    def __init__(self, axis: Axis, run: int) -> None:
        self._axis = axis
        self._refusal: Exception | None = None
        try:
            self.recipe = recipe_id(axis)
        except Exception as error:  # its first message reports it: a stream without one has nothing to store it with
            self.recipe, self._refusal = _NO_RECIPE, error
        self.run = run
        self.position = run - 1
        """Number in the log of the last message that was processed."""
        self.responses = 0
        self.failure = ""
        """Why it is not tracked any more; empty while it is."""
        self.log_s = 0.0
        """Time of the last message by the clock of the log."""
        self.changes, self.changed_s = 0, 0.0
        """Alarms of monitoring since the beginning of the run, and when the newest was raised, by the log's clock."""
        self.main: MainQuantity | None = None
        """The newest value of the quantity that a page shows first; None until a fit is valid."""
        self._events = SourceEvents(clock=lambda: self.log_s)
        self._limits = EventLimits()
        self._fit_period = 0
        settings = axis.source
        self._quantities = DeclaredQuantities(settings.kinds, settings.units)
        self._sequencer = Sequencer(self._events, reorder=settings.reorder_batches, rate_hz=settings.rate_hz)
        self._pipeline: SingleResponse | None = None
        self._added: list[_MessageGroup] = []
        self.usual: UsualSpectra | None = None
        self.spectra: list[PendingSpectrum] = []
        """The messages taken since the last output, while they are usual ones."""
        self._responses: list[Responses] = []
        self._tracked_events: list[Event] = []

    @property
    def lost(self) -> int:
        """Samples known to be lost."""
        return self._sequencer.lost

    def process(self, message: bytes, position: int, log_s: float) -> Output:
        """The responses and events of the next message; `position` is its number in the log, `log_s` its time there."""
        self.add(message, position, log_s)
        return self.output()

    def add(self, message: bytes, position: int, log_s: float) -> int:
        """Add the next message, to be tracked together with those after it: the cost is by call, not by sample.

        Returns the most bytes that it adds to a message of results. The responses are those of `process`, bit for bit.
        """
        self.position, self.log_s = position, log_s
        if self.failure:
            return 0
        before, new = self._events.pending, self._pipeline is None
        spectrum = self.usual and self.usual.spectrum(message, position, log_s, self._sequencer, self._events)
        if spectrum is not None and self.usual is not None and not self._added:
            self.spectra.append(spectrum)
            return self.usual.size_bytes + _EVENT_BYTES * (self._events.pending - before)
        try:
            if self._refusal is not None:
                raise self._refusal
            self._read_spectra()
            blocks = self._blocks(message) if spectrum is None else [self._block(spectrum)]
            size = self._output_bytes_max(blocks) if blocks else 0
        except Exception as error:  # a fault of one axis must not stop the others of its partition
            self._track()
            self._fail(error)
            return _EVENT_BYTES
        if spectrum is None:
            self.usual = None
            if self._pipeline is not None and size <= _OUTPUT_BYTES_MAX:
                self.usual = UsualSpectra.after(message, blocks, size, self._sequencer, self._pipeline)
        self._add_blocks(position, self._events.position, blocks, size)
        if new:  # what a follower refuses, it refuses at its first message, without those after it
            self._track()
        return min(size, _OUTPUT_BYTES_MAX) + _EVENT_BYTES * (self._events.pending - before)

    def _add_blocks(self, position: int, end: tuple[int, float], blocks: list[LiveBlock], size_bytes: int) -> None:
        if self._added and self._added[-1].size_bytes + size_bytes <= _OUTPUT_BYTES_MAX:
            before = self._added.pop()
            blocks, size_bytes = before.blocks + blocks, before.size_bytes + size_bytes
        self._added.append(_MessageGroup(position, end, blocks, size_bytes))

    def _read_spectra(self) -> None:
        """Process usual messages like any others: they are not tracked with those of other axes."""
        spectra, self.spectra = self.spectra, []
        for spectrum in spectra:
            assert self.usual is not None
            self._add_blocks(spectrum.position, spectrum.end, [self._block(spectrum)], self.usual.size_bytes)

    def _block(self, spectrum: PendingSpectrum) -> LiveBlock:
        batch = read_message(spectrum.message, spectrum.log_s).in_si(self._quantities)
        return batch.block(spectrum.number, spectrum.first_sample, False)

    def stacked(self) -> int:
        """The first of the pending spectra was tracked with those of others; returns the number of its response."""
        del self.spectra[0]
        self.responses += 1
        return self.responses - 1

    @property
    def has_more(self) -> bool:
        """Whether it has taken messages that are not tracked, or has events."""
        return bool(self.spectra or self._added or self._tracked_events or self._events.pending)

    def output(self) -> Output:
        """The responses, fits and events of all messages taken since the last call."""
        return outputs_together([self])[0]

    def tracked(self) -> UnfittedOutput:
        """Results before the fits; `finished` follows."""
        self._track()
        first, responses, self._responses = self.responses, self._responses, []
        self.responses += sum(map(len, responses))
        every = responses[0] if len(responses) == 1 else Responses.join(responses) if responses else None
        return self.unfitted(first, every)

    def unfitted(self, number: int, responses: Responses | None) -> UnfittedOutput:
        """These responses, from this number on, with the events until now."""
        return UnfittedOutput(number, responses, self._to_fit(responses), self._new_events() + self._events.take())

    def _new_events(self) -> list[Event]:
        """Events since the last call, in the list that the estimate appends to."""
        events = list(self._tracked_events)
        self._tracked_events.clear()
        return events

    @property
    def pipeline(self) -> SingleResponse:
        """The stages; they exist from the first Block on."""
        assert self._pipeline is not None
        return self._pipeline

    @property
    def detection(self) -> ChangeDetection | None:
        """What monitors the axis, from the first Block on."""
        return None if self._pipeline is None else self._pipeline.detection

    def finished(self, tracked: UnfittedOutput, fitted: Fitted | Exception) -> Output:
        """The output, with the fits of the responses that `tracked` lists, or why there are none; monitors both."""
        parameters, events = ((), []) if isinstance(fitted, Exception) else fitted
        stored = [*tracked.events, *events]
        try:
            if isinstance(fitted, Exception):
                raise fitted
            stored += self._monitored(tracked.responses, parameters)
        except Exception as error:
            self._fail(error)
            stored += self._new_events()
        self._remember(stored, parameters)
        return Output(
            tracked.number, tracked.responses, tracked.number + tracked.to_fit, parameters, self._limits.process(stored)
        )

    def _monitored(self, responses: Responses | None, parameters: tuple[Parameters, ...]) -> list[Event]:
        if self.detection is None or responses is None or self.failure:
            return []
        ready = responses if responses.ready.all() else responses[responses.ready]
        return self.detection.take_responses(ready, parameters[0] if parameters else None)

    def _remember(self, events: list[Event], parameters: tuple[Parameters, ...]) -> None:
        if changes := sum(event.kind == "change" for event in events):
            self.changes, self.changed_s = self.changes + changes, self.log_s
        if parameters:
            detection = self.detection
            name = main_quantity(parameters, () if detection is None else detection.watched)
            self.main = newest_of(parameters, name, detection) or self.main

    def _to_fit(self, responses: Responses | None) -> NDArray[np.int64]:
        """Which responses are fitted: the first one of each half second by the sender's sample numbers.

        So another owner fits the same ones, however it takes the messages. Half a second is a whole number of windows,
        and begins where monitoring expects its rows.
        """
        if self._pipeline is None or self._pipeline.fits is None or responses is None or self.failure:
            return NO_ROWS
        settings = self._pipeline.follower.settings
        window, rate_hz = settings.lines.window, settings.lines.rate_hz
        apart = max(window, settings.step)
        period = apart * max(1, round(rate_hz / FITS_PER_S / apart))
        begun = (responses.sample + 1 - places(window, settings.step)[0]) // period
        first = np.diff(begun, prepend=self._fit_period) != 0
        self._fit_period = int(begun[-1])
        return np.flatnonzero(first & responses.ready)

    def _blocks(self, message: bytes) -> list[LiveBlock]:
        blocks = self._sequencer.poll(self.log_s)
        try:
            batch = read_message(message, self.log_s)
        except SourceError as error:
            self._events.report(
                "malformed",
                Message("message {log_message} of the log was dropped: {why}", log_message=self.position, why=error),
            )
            return blocks
        return blocks + self._sequencer.push(batch.in_si(self._quantities))

    def _output_bytes_max(self, blocks: list[LiveBlock]) -> int:
        """Most bytes of the responses that these Blocks complete; [motion] delays them by a chunk and a window."""
        if self._pipeline is None:
            self._pipeline = self._new_pipeline(blocks[0].rate_hz)
        settings = self._pipeline.follower.settings
        samples = sum(block.stop - block.start for block in blocks)
        if self._axis.motion is not None:
            samples += round(self._axis.motion.chunk_s * settings.lines.rate_hz) + settings.lines.window
        return (samples // settings.step + len(blocks) + 1) * len(settings.lines) * RESPONSE_BYTES

    def _track(self) -> None:
        self._read_spectra()
        taken, self._added = self._added, []
        for part in taken:
            tracked: list[Responses] = []
            if not self.failure:
                try:
                    tracked += map(self._tracked, join_blocks(part.blocks))
                except Exception as error:
                    self._fail(error)
            if sum(batch.value.size for batch in tracked) * RESPONSE_BYTES > _OUTPUT_BYTES_MAX:
                message = Message(
                    "message {log_message} of the log has too many samples: its responses were dropped",
                    log_message=part.position,
                )
                self._tracked_events.append(Event("malformed", *part.end, message))
                tracked = []
            self._responses += [batch for batch in tracked if len(batch)]

    def _new_pipeline(self, rate_hz: float) -> SingleResponse:
        schema = self._sequencer.schema
        follower = live_follower(self._axis, rate_hz, schema.spectra)
        estimate = SingleResponse.of(self._axis, follower, schema.channels, samples=schema.spectra is None)
        estimate.events = self._tracked_events
        return estimate

    def _tracked(self, block: LiveBlock) -> Responses:
        """Responses of a Block by the rules of a run: its loop has the same order."""
        estimate = self.pipeline
        self._tracked_events += estimate.monitor(block)
        responses = estimate.process(block)
        if estimate.fits is not None and len(responses) and not self.responses:
            estimate.fits.process(responses[0:0])  # what a model cannot be fitted to, it refuses here
        return responses

    def _fail(self, error: Exception) -> None:
        if not isinstance(error, LivebodeError):
            _logger.exception("internal error at message %d of the log", self.position)
        self.failure = (str(error) or type(error).__name__)[:_FAILURE_LETTERS_MAX]
        message = Message("the axis is not tracked any more: {why}", why=self.failure)
        self._tracked_events.append(Event("axis-failed", *self._events.position, message))

    @property
    def _identity(self) -> str:
        return self.recipe

    def _state(self) -> dict[str, Any]:
        pending = self._added or self.spectra
        assert not pending, "a snapshot between take and output would lack samples"
        parts = {} if self._pipeline is None else {name: part.snapshot() for name, part in self._pipeline.parts.items()}
        own = {"sequencer": self._sequencer.snapshot(), "source_events": self._events.rates, "stages": list(parts)}
        return super()._state() | own | parts

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._events.continue_at(state["source_events"])
        self._sequencer.restore(state["sequencer"])
        self._pipeline, self.main, self.usual = None, None, None
        if state["stages"]:
            rate_hz = self._sequencer.schema.rate_hz
            assert rate_hz is not None
            self._pipeline = self._new_pipeline(rate_hz)
            restore_parts(self._pipeline.parts, {name: state[name] for name in self._pipeline.parts})
