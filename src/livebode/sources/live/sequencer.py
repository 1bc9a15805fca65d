"""Sequencer: takes batches as they arrive, returns Blocks in order."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

from livebode.core import Stage, StatefulBase
from livebode.language import Message
from livebode.sources.live.batch import VALUES_MAX, LiveBlock
from livebode.sources.live.batch_state import batches_from_state, batches_to_state
from livebode.sources.live.clock import ClockMonitor
from livebode.sources.live.computer_clock import ClockReading, pause
from livebode.sources.live.joined import block_of, join_blocks
from livebode.sources.live.position import Position
from livebode.sources.live.source_events import SourceEvents
from livebode.sources.live.spectra_batch import AnyBatch, SpectraBatch
from livebode.sources.live.stream_schema import StreamSchema
from livebode.sources.live.unconfirmed import CONFIRMED, UnconfirmedBatches

FAR_BACK_S = 60.0
FAR_AHEAD_S = 3600.0
JUMP_S = 1.0
"""A batch that is further ahead than this and than possible losses is accepted only when more follow it."""
CLOCK_S = 10.0
"""How much the pause of a sender without an epoch may be longer by its numbers than by this computer's clock."""
_EPOCHS_REMEMBERED = 64
_RUN_BYTES_MAX = 8 * VALUES_MAX
_PLAIN = ("_epoch", "_next", "_highest", "_progress_s", "_gap", "_number", "_begun_at", "_paced", "lost")


class Sequencer(StatefulBase):
    """Puts batches in order by the numbers of their samples.

    Batches that arrive at most `reorder` batches late are sorted; samples that are then still missing are lost: the
    next Block begins at the later number with its gap flag. Repeats are dropped. A restart of the sender, detected
    from its epoch or from numbers that begin again, is a gap of unknown size. Blocks are numbered from the first
    sample received, from the position at which a run continues (`resume`), or by the sender (`sender_numbers`).

    A batch that is out of place is accepted only when more of its kind follow, with none of the stream between them; a
    sender that was replaced is accepted again in the same way. This and `reorder` bound the memory.

    A restored sequencer returns the Blocks that the first one would have returned. `arrived_s` and `now_s` must then be
    of one clock on both sides: of the log for a stream that another computer continues, not `time.monotonic()`. Events
    that were reported before the snapshot stay with their collector.

    Parameters
    ----------
    source_events
        Collector of Events; receives losses, repeats, reordering and restarts.
    reorder
        Number of batches to wait for a missing one, and to collect before the stream begins.
    wait_s
        Longest time to wait for a missing one.
    rate_hz
        Required rate, if it is known in advance.
    confirmed
        Batches of a new epoch that must arrive before it is accepted: 1 if only one sender is possible.
    sender_numbers
        Number the Blocks as the sender numbers its samples, from the first one received until a restart of the sender:
        the numbers do not depend on when reading begins. Else they begin with 0.
    """

    _stage = Stage("sequencer", 1)

    def __init__(
        self,
        source_events: SourceEvents,
        *,
        reorder: int = 8,
        wait_s: float = 1.0,
        rate_hz: float | None = None,
        confirmed: int = CONFIRMED,
        sender_numbers: bool = False,
    ) -> None:
        self._events, self._reorder, self._wait_s = source_events, reorder, wait_s
        self._unconfirmed = UnconfirmedBatches(source_events, confirmed, reorder)
        self._settings = f"reorder={reorder} wait_s={wait_s!r} rate_hz={rate_hz!r} confirmed={confirmed}"
        self._settings += f" sender_numbers={sender_numbers}"
        self._sender_numbers = sender_numbers
        self._jump_s = JUMP_S if confirmed > 1 else FAR_AHEAD_S
        self.schema = StreamSchema(source_events, rate_hz)
        self.clock: ClockMonitor | None = None
        self._epoch: int | None = None
        self._left: dict[int, int] = {}
        self._next: int | None = None
        self._highest = -1
        self._waiting: dict[int, AnyBatch] = {}
        self._progress_s = 0.0
        self._gap = False
        self._number = 0
        self._begun_at = 0
        self._resumed: Position | None = None
        self._paced = True
        self.lost = 0
        """Samples known to be lost."""

    @property
    def first_sample(self) -> int | None:
        """The sender's number of the sample at its last start; None before the first."""
        return None if self._next is None else self._begun_at

    @property
    def number(self) -> int:
        """Number of the sample after the last Block."""
        return self._number

    @property
    def oldest_delivery(self) -> float:
        """Delivery of the oldest batch that waits here or is in doubt; infinite if there is none."""
        waiting = min((batch.delivery for batch in self._waiting.values()), default=inf)
        return min(waiting, self.oldest_doubt)

    @property
    def oldest_doubt(self) -> float:
        """The same of those that are in doubt."""
        return self._unconfirmed.oldest_delivery

    def resume(self, position: Position, *, paced: bool = True) -> None:
        """Continue a record at this position; to be called before the first batch.

        The sender's numbers give exactly what is missing. After a restart of the sender, this computer's clock
        estimates it, if the sender is `paced`, that is sends its samples when they are taken.
        """
        self._resumed, self._paced = position, paced
        self._epoch, self._next, self._number = position.epoch, position.number, position.sample
        self._begun_at = position.number
        self._events.position = (position.sample, position.sample / position.rate_hz)

    def push(self, batch: AnyBatch) -> list[LiveBlock]:
        """Blocks completed by this batch."""
        aligned = self.schema.aligned(batch)
        if aligned is None:
            return []
        if self._epoch is None:
            self._epoch = batch.epoch
        if self._fits(aligned):
            self._unconfirmed.dismiss(self._epoch, self._next)  # the stream continues, so they did not belong to it
            return self._insert(aligned)
        return self._doubt(aligned)

    def push_together(self, batches: Sequence[AnyBatch]) -> list[LiveBlock]:
        """The same for several batches; those of which one follows the other are one Block."""
        blocks: list[LiveBlock] = []
        run: list[AnyBatch] = []
        begin = size_bytes = 0
        for batch in batches:
            number = self._passed(batch)
            size_bytes += batch.nbytes
            if run and (number is None or size_bytes > _RUN_BYTES_MAX):
                blocks.append(block_of(run, begin))
                run, size_bytes = [], batch.nbytes
            if number is None:
                blocks += self.push(batch)
                continue
            begin = begin if run else number
            run.append(batch)
        if run:
            blocks.append(block_of(run, begin))
        return join_blocks(blocks)

    def _passed(self, batch: AnyBatch) -> int | None:
        """The number of its Block, if it is the next batch of a stream in which nothing waits; see `passed`."""
        if not self.is_idle or batch.epoch != self._epoch or not self.schema.is_same(batch):
            return None
        return self.passed(batch.first_sample, batch.samples, batch.rate_hz, batch.stamp_s, batch.arrived_s)

    @property
    def is_idle(self) -> bool:
        """Whether nothing waits or is in doubt, so that `passed` takes the next batch."""
        open_ = self._waiting or self._unconfirmed.pending or self._resumed is not None
        return self._next is not None and not (self._gap or open_)

    def passed(self, first: int, samples: int, rate_hz: float, stamp_s: float | None, arrived_s: float) -> int | None:
        """Take a batch of the stream that begins with the due sample, as `push` would, without making a Block of it.

        Only while it is idle, for a batch that would not change its schema or epoch. Returns the number of the Block;
        None, and nothing has changed, if the batch begins with another sample.
        """
        if first != self._next:
            return None
        self._highest = max(self._highest, first)
        number = self._number
        self._continue(first, samples, number, rate_hz, stamp_s, arrived_s)
        return number

    def poll(self, now_s: float) -> list[LiveBlock]:
        """Blocks that waited long enough for missing samples before them; `now_s` as in `arrived_s`."""
        if not self._waiting:
            return []
        since = max(self._progress_s, min(batch.arrived_s for batch in self._waiting.values()))
        return self._release(0) if now_s - since > self._wait_s else []

    def finish(self) -> list[LiveBlock]:
        """Blocks of all waiting batches, at the end of the source."""
        self._unconfirmed.dismiss(self._epoch, self._next)
        return self._release(0)

    def _fits(self, batch: AnyBatch) -> bool:
        if batch.epoch != self._epoch:
            return False
        if self._next is None:
            near = next(iter(self._waiting.values()), batch).first_sample
            return abs(batch.first_sample - near) <= FAR_BACK_S * batch.rate_hz
        near_ahead = max(self._jump_s * batch.rate_hz, (self._reorder + 1) * batch.samples)
        ahead = min(near_ahead, self._ahead_max(batch)) if self._resumed is not None else near_ahead
        return batch.stop > self._next and batch.first_sample <= max(self._next, self._highest) + ahead

    def _ahead_max(self, batch: AnyBatch) -> float:
        """How many samples a sender that was not restarted can be ahead of the stream."""
        if self._epoch:
            return float("inf")
        seconds = None if self._resumed is None else self._pause_s(batch, self._resumed)
        return (FAR_AHEAD_S if seconds is None else seconds + CLOCK_S) * batch.rate_hz

    def _pause_s(self, batch: AnyBatch, resumed: Position) -> float | None:
        """From the last recorded sample to the batch's first one, by this computer's clock."""
        found = pause(resumed.arrived, ClockReading.at(batch.arrived_s)).seconds
        return None if found is None or not self._paced else max(0.0, found - batch.samples / batch.rate_hz)

    def _insert(self, batch: AnyBatch) -> list[LiveBlock]:
        known = self._waiting.get(batch.first_sample)
        if known is not None and known.stop >= batch.stop:
            self._repeat(batch)
            return []
        if batch.first_sample < self._highest:
            self._events.report(
                "reordered",
                Message(
                    "sample {sender_sample} of the sender arrived late and was sorted in",
                    sender_sample=batch.first_sample,
                ),
            )
        self._highest = max(self._highest, batch.first_sample)
        self._waiting[batch.first_sample] = batch
        return self._release(self._reorder)

    def _release(self, waiting_max: int) -> list[LiveBlock]:
        """Blocks in order; while more than `waiting_max` batches wait, also those after missing samples."""
        blocks = []
        while self._waiting:
            first = min(self._waiting)
            if self._next is None:
                if len(self._waiting) <= waiting_max:
                    break
                self._next = self._begun_at = first
                if self._sender_numbers and self._number == 0:
                    self._number = first
            if first > self._next:
                if len(self._waiting) <= waiting_max:
                    break
                self._lose(first)
            batch = self._waiting.pop(first)
            if batch.stop <= self._next:
                self._repeat(batch)
            else:
                blocks.append(self._emit(batch, self._next))
        return blocks

    def _emit(self, batch: AnyBatch, start: int) -> LiveBlock:
        block = batch.block(self._number, start, self._gap)
        stamp_s = None if batch.stamp_s is None else batch.stamp_s + (start - batch.first_sample) / batch.rate_hz
        self._gap, self._resumed = False, None
        self._continue(start, batch.stop - start, self._number, batch.rate_hz, stamp_s, batch.arrived_s)
        return block

    def _continue(
        self, start: int, samples: int, number: int, rate_hz: float, stamp_s: float | None, arrived_s: float
    ) -> None:
        """Count the sender's samples from `start` on, which get numbers from `number` on."""
        if stamp_s is not None:
            self.clock = self.clock or ClockMonitor(self._events, rate_hz)
            self.clock.take(start, stamp_s, number)
        self._next, self._number, self._progress_s = start + samples, number + samples, arrived_s
        self._events.position = (self._number, self._number / rate_hz)

    def _lose(self, first: int) -> None:
        assert self._next is not None
        missing = first - self._next
        rate_hz = self.schema.rate_hz or 1.0
        self.lost += missing
        self._number += missing
        message = Message("{missing_samples} samples were lost", missing_samples=missing)
        if self._resumed is not None and not self._epoch:
            message = Message(
                "{lost}; the sender sends no epoch, so a restart during the pause would not be detected", lost=message
            )
        self._events.report("loss", message, sample=self._number, rate_hz=rate_hz, missing_samples=missing)
        self._next, self._gap = first, True

    def _repeat(self, batch: AnyBatch) -> None:
        self._events.report(
            "repeat",
            Message("sample {sender_sample} of the sender was repeated and dropped", sender_sample=batch.first_sample),
        )

    def _doubt(self, batch: AnyBatch) -> list[LiveBlock]:
        """Handle a batch that does not continue the stream: a repeat, a jump, another sender, or a restart."""
        far = self._next is None or batch.stop < self._next - FAR_BACK_S * batch.rate_hz
        ahead = batch.epoch == self._epoch and self._next is not None and batch.first_sample > self._next
        if self._repeats_recorded(batch):
            self._repeat(batch)
            return []
        if batch.epoch != self._epoch:
            accepted = self._unconfirmed.another_epoch(
                batch, self._epoch, self._next, replaced=batch.epoch in self._left
            )
        elif ahead:
            accepted = self._unconfirmed.ahead(batch, self._epoch, self._next, self._jump_s * batch.rate_hz)
        else:
            accepted = self._unconfirmed.behind(batch, self._epoch, self._next, far=far)
        if not accepted:
            return []
        if ahead and batch.first_sample - (self._next or 0) <= self._ahead_max(batch):
            return [block for late in accepted for block in self._insert(late)]
        return self._restart(accepted)

    def _repeats_recorded(self, batch: AnyBatch) -> bool:
        """Whether a broker repeats samples that are already recorded: with the same epoch there was no restart."""
        known = self._resumed is not None and bool(self._epoch) and batch.epoch == self._epoch
        return known and self._next is not None and batch.stop <= self._next

    def _restart(self, accepted: list[AnyBatch]) -> list[LiveBlock]:
        """Continue with these batches of another epoch, or of numbers that begin again."""
        blocks = self._release(0)
        epoch, first = accepted[0].epoch, min(batch.first_sample for batch in accepted)
        offset = self._left.pop(epoch, None)
        if self._epoch is not None and epoch != self._epoch and self._next is not None:
            self._left[self._epoch] = self._next - self._number
            while len(self._left) > _EPOCHS_REMEMBERED:
                del self._left[next(iter(self._left))]
        back = offset is not None and first - offset >= self._number - FAR_BACK_S * accepted[0].rate_hz
        if offset is not None and back:
            self._return_to(epoch, offset, first)
        else:
            self._restart_numbering(accepted[0], first)
        self._epoch, self._highest, self._gap = epoch, -1, self._number > 0
        if self.clock is not None:
            self.clock.restart()
        for batch in accepted:
            if self._next is None or batch.stop > self._next:
                blocks += self._insert(batch)
        return blocks

    def _restart_numbering(self, batch: AnyBatch, first: int) -> None:
        seconds = None if self._resumed is None else self._pause_s(batch, self._resumed)
        missing, how = 0, Message("the length of its pause is not known")
        if seconds is not None:
            step = batch.layout.hop if isinstance(batch, SpectraBatch) else 1
            missing = step * round(seconds * batch.rate_hz / step)
            how = Message(
                "its pause was {pause_s:.1f} s by this computer's clock, which is an estimate", pause_s=seconds
            )
        self._number += missing
        self._report_restart(
            Message("the sender restarted at its sample {sender_sample}; {pause}", sender_sample=first, pause=how),
            batch.epoch,
            first,
            estimated_samples=missing,
        )
        self._next, self._resumed = None, None

    def _return_to(self, epoch: int, offset: int, first: int) -> None:
        """Accept a replaced sender again: its numbers still give the time."""
        lost = max(0, self._number + offset - first)
        self.lost += lost
        self._next = self._number + offset
        message = Message(
            "the sender of epoch {epoch} still sends, and the one that replaced it (epoch{other_epoch}) is silent; the "
            "first continues at its sample {next_sample}; {lost_samples} of its samples were not recorded. If only one "
            "machine may send, set its address in source.sender",
            epoch=f"{epoch:#x}",
            other_epoch="" if self._epoch is None else f" {self._epoch:#x}",
            next_sample=max(first, self._next),
            lost_samples=lost,
        )
        self._report_restart(message, epoch, first)

    def _report_restart(self, message: str, epoch: int, first: int, **details: int) -> None:
        self._events.report(
            "restart",
            message,
            sample=self._number,
            rate_hz=self.schema.rate_hz or 1.0,
            sender_sample=first,
            epoch=f"{epoch:#x}",
            **details,
        )

    @property
    def _identity(self) -> str:
        return self._settings

    def _state(self) -> dict[str, Any]:
        return {name.lstrip("_"): getattr(self, name) for name in _PLAIN} | {
            "left": list(self._left.items()),
            "resumed": None if self._resumed is None else self._resumed.to_plain(),
            "position": self._events.position,
            "waiting": batches_to_state(list(self._waiting.values())),
            "schema": self.schema,
            "unconfirmed": self._unconfirmed,
            "clock": self.clock,
        }

    def _load(self, state: dict[str, Any]) -> None:
        for name in _PLAIN:
            setattr(self, name, state[name.lstrip("_")])
        self._left = dict(state["left"])
        self._resumed = None if state["resumed"] is None else Position.from_plain(state["resumed"])
        self._waiting = {batch.first_sample: batch for batch in batches_from_state(state["waiting"])}
        self.schema.restore(state["schema"])
        self._unconfirmed.restore(state["unconfirmed"])
        self.clock = None
        if state["clock"] is not None:
            self.clock = ClockMonitor(self._events, self.schema.rate_hz or 1.0)
            self.clock.restore(state["clock"])
        sample, time_s = state["position"]
        self._events.position = (sample, time_s)
