"""Doubts: batches out of place, until enough of a kind have come to believe them."""

from __future__ import annotations

from livebode.sources.live.said import Said
from livebode.sources.live.spectra_batch import AnyBatch

CONFIRMED = 2
"""Batches that another stream must bring before it is believed."""
CONFIRMED_AHEAD = 3
"""The same of one that is far ahead: its numbers become a loss, which cannot be taken back."""
CONFIRMED_NEAR = 32
"""The same where numbers go back by less than a minute: a broker may send that many again."""


class Doubts:
    """Batches that are not where the stream continues, of one kind at a time; those of another kind take their place.

    Parameters
    ----------
    said
        Where those that were not believed are reported.
    confirmed
        Batches that a new epoch must bring.
    reorder
        Batches that may come late: a replaced epoch must bring more to be believed again.
    """

    def __init__(self, said: Said, confirmed: int, reorder: int) -> None:
        self._said, self._confirmed = said, confirmed
        self._confirmed_again = max(CONFIRMED, reorder + 1)
        self._doubted: list[AnyBatch] = []

    def another_epoch(self, batch: AnyBatch, epoch: int | None, due: int | None, *, replaced: bool) -> list[AnyBatch]:
        """Take a batch of another epoch than the stream's; what is believed now, if anything."""
        follows = bool(self._doubted) and self._doubted[-1].epoch == batch.epoch
        return self._taken(batch, epoch, due, follows, self._confirmed_again if replaced else self._confirmed)

    def ahead(self, batch: AnyBatch, epoch: int | None, due: int | None, near: float) -> list[AnyBatch]:
        """Take a batch that is far ahead; those that follow it are `near` it."""
        last = self._doubted[-1] if self._doubted else None
        follows = last is not None and last.epoch == batch.epoch and abs(batch.first_sample - last.stop) <= near
        return self._taken(batch, epoch, due, follows, CONFIRMED_AHEAD)

    def behind(self, batch: AnyBatch, epoch: int | None, due: int | None, *, far: bool) -> list[AnyBatch]:
        """Take a batch that is behind: repeated, or of numbers that begin again."""
        last = self._doubted[-1] if self._doubted else None
        follows = last is not None and last.epoch == batch.epoch and last.stop == batch.first_sample
        return self._taken(batch, epoch, due, follows, CONFIRMED if far else CONFIRMED_NEAR)

    def dismiss(self, epoch: int | None, due: int | None) -> None:
        """Drop them: they were repeats, if of the stream's `epoch` and from before the sample that is `due`."""
        doubted, self._doubted = self._doubted, []
        for batch in doubted:
            if batch.epoch == epoch and due is not None and batch.stop <= due:
                self._said.say("repeat", f"sample {batch.first_sample} of the sender came again and was dropped")
            else:
                self._said.say(
                    "foreign",
                    f"a batch at sample {batch.first_sample} of epoch {batch.epoch:#x} does not belong to the stream "
                    "and was dropped",
                    epoch=f"{batch.epoch:#x}",
                    sender_sample=batch.first_sample,
                )

    def _taken(self, batch: AnyBatch, epoch: int | None, due: int | None, follows: bool, needed: int) -> list[AnyBatch]:
        if not follows:
            self.dismiss(epoch, due)
        self._doubted.append(batch)
        if len(self._doubted) < needed:
            return []
        believed, self._doubted = self._doubted, []
        return believed
