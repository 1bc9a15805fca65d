"""Sequencer: batches as they arrive in, Blocks in order out."""

from __future__ import annotations

from collections import deque

from livebode.sources.live.batch import LiveBlock
from livebode.sources.live.clock import ClockWatch
from livebode.sources.live.face import Face
from livebode.sources.live.said import Said
from livebode.sources.live.spectra_batch import AnyBatch

FAR_BACK_S = 60.0
FAR_AHEAD_S = 3600.0
CONFIRMED = 2
"""Batches that another stream must bring before it is believed."""
CONFIRMED_NEAR = 32
"""The same where numbers go back by less than a minute: a broker may send that many again."""
_EPOCHS_REMEMBERED = 64


class Sequencer:
    """Puts batches in order by the numbers of their samples.

    Batches that arrive at most `reorder` batches late are put right; what is then still missing is lost: the next Block
    begins at the later number with its gap flag. What comes twice is dropped. A restart of the sender, told by its
    epoch or by numbers that begin anew, is a gap of unknown length. Blocks are numbered from the first sample received.

    A batch out of place is believed only when more of its kind follow; memory is bounded by that and by `reorder`.

    Parameters
    ----------
    said
        Where losses, repeats, reordering and restarts are told.
    reorder
        Batches to wait for a missing one; also how many are gathered before the stream begins.
    wait_s
        Longest time to wait for a missing one.
    rate_hz
        The rate that must be, where it is known beforehand.
    confirmed
        Batches that a new epoch must bring before it is believed: 1 where nobody else can send.
    """

    def __init__(
        self,
        said: Said,
        *,
        reorder: int = 8,
        wait_s: float = 1.0,
        rate_hz: float | None = None,
        confirmed: int = CONFIRMED,
    ) -> None:
        self._said, self._reorder, self._wait_s = said, reorder, wait_s
        self._confirmed = confirmed
        self.face = Face(said, rate_hz)
        self.clock: ClockWatch | None = None
        self._epoch: int | None = None
        self._left: deque[int] = deque(maxlen=_EPOCHS_REMEMBERED)
        self._next: int | None = None
        self._highest = -1
        self._waiting: dict[int, AnyBatch] = {}
        self._doubted: list[AnyBatch] = []
        self._progress_s = 0.0
        self._gap = False
        self._number = 0
        self._begun_at = 0
        self.lost = 0
        """Samples that were lost, of those whose number is known."""

    @property
    def first_sample(self) -> int | None:
        """The sender's number of the sample at which it was begun, or begun anew; None before."""
        return None if self._next is None else self._begun_at

    def push(self, batch: AnyBatch) -> list[LiveBlock]:
        """Blocks that this batch completes."""
        aligned = self.face.aligned(batch)
        if aligned is None:
            return []
        if self._epoch is None:
            self._epoch = batch.epoch
        if self._fits(aligned):
            if self._doubted and self._doubted[0].epoch == self._epoch:
                self._dismiss()  # the stream goes on, so what came from before it were repeats
            return self._insert(aligned)
        return self._doubt(aligned)

    def poll(self, now_s: float) -> list[LiveBlock]:
        """Blocks that have waited long enough for what is missing before them; `now_s` as in `arrived_s`."""
        if not self._waiting:
            return []
        since = max(self._progress_s, min(batch.arrived_s for batch in self._waiting.values()))
        return self._release(0) if now_s - since > self._wait_s else []

    def finish(self) -> list[LiveBlock]:
        """Blocks of everything that still waits: nothing more will come."""
        self._dismiss()
        return self._release(0)

    def _fits(self, batch: AnyBatch) -> bool:
        if batch.epoch != self._epoch:
            return False
        if self._next is None:
            near = next(iter(self._waiting.values()), batch).first_sample
            return abs(batch.first_sample - near) <= FAR_BACK_S * batch.rate_hz
        return batch.stop > self._next and batch.first_sample <= self._next + FAR_AHEAD_S * batch.rate_hz

    def _insert(self, batch: AnyBatch) -> list[LiveBlock]:
        known = self._waiting.get(batch.first_sample)
        if known is not None and known.stop >= batch.stop:
            self._repeat(batch)
            return []
        if batch.first_sample < self._highest:
            self._said.say("reordered", f"sample {batch.first_sample} of the sender came late and was put in its place")
        self._highest = max(self._highest, batch.first_sample)
        self._waiting[batch.first_sample] = batch
        return self._release(self._reorder)

    def _release(self, waiting_max: int) -> list[LiveBlock]:
        """What is in order, and beyond what is missing while more than `waiting_max` batches wait."""
        blocks = []
        while self._waiting:
            first = min(self._waiting)
            if self._next is None:
                if len(self._waiting) <= waiting_max:
                    break
                self._next = self._begun_at = first
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
        if batch.stamp_s is not None:
            self.clock = self.clock or ClockWatch(self._said, batch.rate_hz)
            self.clock.take(start, batch.stamp_s + (start - batch.first_sample) / batch.rate_hz, self._number)
        self._gap = False
        self._next, self._number = batch.stop, block.stop
        self._progress_s = batch.arrived_s
        self._said.position = (self._number, self._number / batch.rate_hz)
        return block

    def _lose(self, first: int) -> None:
        assert self._next is not None
        missing = first - self._next
        rate_hz = self.face.rate_hz or 1.0
        self.lost += missing
        self._number += missing
        self._said.say(
            "loss",
            f"{missing} samples did not come",
            sample=self._number,
            rate_hz=rate_hz,
            missing_samples=missing,
        )
        self._next, self._gap = first, True

    def _repeat(self, batch: AnyBatch) -> None:
        self._said.say("repeat", f"sample {batch.first_sample} of the sender came again and was dropped")

    def _doubt(self, batch: AnyBatch) -> list[LiveBlock]:
        """A batch that is not where the stream goes on: a repeat, another sender, or this one begun anew."""
        if batch.epoch in self._left:
            self._said.say("foreign", "a batch of a sender that was replaced, or of a second one, was dropped")
            return []
        last = self._doubted[-1] if self._doubted else None
        new_epoch = batch.epoch != self._epoch
        if last is not None and (last.epoch != batch.epoch or not (new_epoch or last.stop == batch.first_sample)):
            self._dismiss()
        self._doubted.append(batch)
        needed = self._confirmed if new_epoch else CONFIRMED if self._is_far(batch) else CONFIRMED_NEAR
        if len(self._doubted) < needed:
            return []
        return self._restart()

    def _is_far(self, batch: AnyBatch) -> bool:
        return self._next is None or (
            batch.stop < self._next - FAR_BACK_S * batch.rate_hz or batch.first_sample > self._next
        )

    def _dismiss(self) -> None:
        doubted, self._doubted = self._doubted, []
        for batch in doubted:
            if batch.epoch == self._epoch and self._next is not None and batch.stop <= self._next:
                self._repeat(batch)
            else:
                self._said.say("foreign", f"a batch at sample {batch.first_sample}, of no stream, was dropped")

    def _restart(self) -> list[LiveBlock]:
        doubted, self._doubted = self._doubted, []
        blocks = self._release(0)
        if self._epoch is not None and doubted[0].epoch != self._epoch:
            self._left.append(self._epoch)
        self._said.say(
            "restart",
            f"the sender began anew at its sample {doubted[0].first_sample}; how long it paused is not known",
            sample=self._number,
            rate_hz=self.face.rate_hz or 1.0,
            sender_sample=doubted[0].first_sample,
        )
        self._epoch, self._next, self._highest, self._gap = doubted[0].epoch, None, -1, self._number > 0
        if self.clock is not None:
            self.clock.restart()
        for batch in doubted:
            blocks += self._insert(batch)
        return blocks
