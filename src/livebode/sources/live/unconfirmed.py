"""Doubts: batches that are out of place, until enough of one kind arrived to accept them."""

from __future__ import annotations

from math import inf
from typing import Any

from livebode.core import Stage, StatefulBase
from livebode.language import Message
from livebode.sources.live.batch_state import batches_from_state, batches_to_state
from livebode.sources.live.source_events import SourceEvents
from livebode.sources.live.spectra_batch import AnyBatch

CONFIRMED = 2
"""Batches of another stream that must arrive before it is accepted."""
CONFIRMED_AHEAD = 3
"""The same for a stream that is far ahead: its numbers are reported as a loss, which cannot be undone."""
CONFIRMED_NEAR = 32
"""The same if numbers go back by less than a minute: a broker may repeat that many."""


class UnconfirmedBatches(StatefulBase):
    """Batches that do not continue the stream, of one kind at a time; a batch of another kind replaces them.

    Where the stream would begin again, batches that a broker delivers `again` may be recorded already: they are
    accepted only with one that it delivers for the first time.

    Parameters
    ----------
    source_events
        Collector of Events; receives those of rejected batches.
    confirmed
        Batches of a new epoch that must arrive before it is accepted.
    reorder
        Number of batches that may be late: a replaced epoch needs more than this to be accepted again.
    """

    _stage = Stage("unconfirmed-batches", 1)

    def __init__(self, source_events: SourceEvents, confirmed: int, reorder: int) -> None:
        self._events, self._confirmed = source_events, confirmed
        self._confirmed_again = max(CONFIRMED, reorder + 1)
        self._batches: list[AnyBatch] = []

    @property
    def pending(self) -> bool:
        """Whether there are any."""
        return bool(self._batches)

    @property
    def oldest_delivery(self) -> float:
        """Delivery of the oldest one; infinite if there is none."""
        return self._batches[0].delivery if self._batches else inf

    def another_epoch(self, batch: AnyBatch, epoch: int | None, due: int | None, *, replaced: bool) -> list[AnyBatch]:
        """Take a batch of another epoch; returns what is accepted now, if anything."""
        follows = bool(self._batches) and self._batches[-1].epoch == batch.epoch
        needed = self._confirmed_again if replaced else self._confirmed
        return self._taken(batch, epoch, due, follows, inf if batch.again else needed)

    def ahead(self, batch: AnyBatch, epoch: int | None, due: int | None, near: float) -> list[AnyBatch]:
        """Take a batch that is far ahead; its successors are `near` it."""
        last = self._batches[-1] if self._batches else None
        follows = last is not None and last.epoch == batch.epoch and abs(batch.first_sample - last.stop) <= near
        return self._taken(batch, epoch, due, follows, CONFIRMED_AHEAD)

    def behind(self, batch: AnyBatch, epoch: int | None, due: int | None, *, far: bool) -> list[AnyBatch]:
        """Take a batch that is behind: a repeat, or numbers that begin again."""
        last = self._batches[-1] if self._batches else None
        follows = last is not None and last.epoch == batch.epoch and last.stop == batch.first_sample
        needed = CONFIRMED if far else CONFIRMED_NEAR
        return self._taken(batch, epoch, due, follows, inf if batch.again else needed)

    def dismiss(self, epoch: int | None, due: int | None) -> None:
        """Drop them; those of the stream's `epoch` from before the sample that is `due` were repeats."""
        doubted, self._batches = self._batches, []
        for batch in doubted:
            if batch.epoch == epoch and due is not None and batch.stop <= due:
                self._events.report(
                    "repeat",
                    Message(
                        "sample {sender_sample} of the sender was repeated and dropped",
                        sender_sample=batch.first_sample,
                    ),
                )
            else:
                self._events.report(
                    "foreign",
                    Message(
                        "a batch at sample {sender_sample} of epoch {epoch} does not belong to the stream and was "
                        "dropped",
                        sender_sample=batch.first_sample,
                        epoch=f"{batch.epoch:#x}",
                    ),
                )

    def _taken(
        self, batch: AnyBatch, epoch: int | None, due: int | None, follows: bool, needed: float
    ) -> list[AnyBatch]:
        if not follows:
            self.dismiss(epoch, due)
        self._batches.append(batch)
        if len(self._batches) < needed:
            return []
        accepted, self._batches = self._batches, []
        return accepted

    def _state(self) -> dict[str, Any]:
        return {"batches": batches_to_state(self._batches)}

    def _load(self, state: dict[str, Any]) -> None:
        self._batches = batches_from_state(state["batches"])
