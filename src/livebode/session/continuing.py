"""The samples of a run that is gone on with."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from livebode.nouns import Block, Event, Spectra


@dataclass(frozen=True, eq=False)
class Before:
    """Where a run goes on with the very next sample of another one.

    `name` is the other's directory, `sample` and `time_s` are the next sample's, `counts` what the follower that was
    taken over had counted.
    """

    name: str
    sample: int
    time_s: float
    counts: dict[str, int]


def offered_again(blocks: Iterable[Block], sample: int) -> Iterator[Block]:
    """From a source that begins with the same samples again: those from number `sample` on."""
    for block in blocks:
        if block.stop > sample:
            yield block if block.start >= sample else block.cut(sample - block.start, len(block))


def in_pieces(blocks: Iterable[Block], samples: int) -> Iterator[Block]:
    """The same samples in Blocks of at most so many."""
    for block in blocks:
        for first in range(0, len(block), samples):
            yield block.cut(first, first + samples)


class Numbering:
    """Numbers a source on that cannot go back and numbers anew: its samples go on behind a gap.

    One for as long as the source is open, over all runs that it is recorded in.
    """

    def __init__(self) -> None:
        self._behind: tuple[int, float, float] | None = None
        self._shift = 0
        self._origin_s: float | None = None

    def go_on(self, sample: int, origin_s: float, away_s: float) -> None:
        """Give the next sample the number `sample` and what `away_s` comes to, with sample 0 at `origin_s`.

        How many samples are missing is known no better than the two computer clocks that `away_s` comes from.
        """
        self._behind = sample, origin_s, away_s

    def over(self, blocks: Iterable[Block]) -> Iterator[Block]:
        """The same samples, numbered on."""
        for block in blocks:
            if self._behind is not None:
                sample, self._origin_s, away_s = self._behind
                # Spectra keep to their grid of hops.
                step = block.layout.hop if isinstance(block, Spectra) else 1
                self._shift = sample + step * max(1, round(away_s * block.rate_hz / step)) - block.start
                self._behind, block = None, replace(block, gap=True)
            if self._origin_s is not None:
                block = replace(block, start=block.start + self._shift, origin_s=self._origin_s)
            yield block

    def said(self, event: Event, rate_hz: float) -> Event:
        """An event of the source in the same numbers."""
        if self._origin_s is None:
            return event
        sample = event.sample + self._shift
        return replace(event, sample=sample, time_s=self._origin_s + sample / rate_hz)
