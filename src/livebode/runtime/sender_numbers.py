"""How the senders of a live run numbered its samples, for run.json."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from livebode.sources.live import LiveBlock

_PIECES_MAX = 1000


class NumberedFrom(NamedTuple):
    """From sample `sample` of the run on, the sender counts from `sender_sample` in this `epoch`."""

    sample: int
    epoch: int
    sender_sample: int


class SenderNumbers:
    """The numbers of each sender, or of each start of it; of more than 1000 the newest."""

    def __init__(self) -> None:
        self.pieces: list[NumberedFrom] = []

    @classmethod
    def of(cls, plain: Iterable[Iterable[Any]]) -> SenderNumbers:
        """As run.json has them."""
        found = cls()
        found.pieces = [NumberedFrom(*(int(number) for number in piece)) for piece in plain]
        return found

    def take(self, block: LiveBlock) -> bool:
        """Whether another piece begins with this Block."""
        origin = block.origin
        if origin is None:
            return False
        if self.pieces:
            sample, epoch, sender_sample = self.pieces[-1]
            if (epoch, sender_sample - sample) == (origin.epoch, origin.offset):
                return False
        self.pieces.append(NumberedFrom(block.start, origin.epoch, block.start + origin.offset))
        del self.pieces[:-_PIECES_MAX]
        return True
