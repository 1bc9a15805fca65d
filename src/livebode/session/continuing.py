"""The samples of a run that is gone on with."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from livebode.nouns import Block, Spectra


def offered_again(blocks: Iterable[Block], sample: int) -> Iterator[Block]:
    """From a source that begins with the same samples again: those from number `sample` on."""
    for block in blocks:
        if block.stop > sample:
            yield block if block.start >= sample else block.cut(sample - block.start, len(block))


def begun_anew(blocks: Iterable[Block], sample: int, origin_s: float, away_s: float) -> Iterator[Block]:
    """From a source that cannot go back and numbers anew: the numbers go on at `sample`, behind a gap of `away_s`.

    How many samples are missing is known no better than the two computer clocks that `away_s` comes from.
    """
    shift: int | None = None
    for block in blocks:
        if shift is None:
            # Spectra keep to their grid of hops.
            step = block.layout.hop if isinstance(block, Spectra) else 1
            shift = sample + step * max(1, round(away_s * block.rate_hz / step)) - block.start
            block = replace(block, gap=True)
        yield replace(block, start=block.start + shift, origin_s=origin_s)


def in_pieces(blocks: Iterable[Block], samples: int) -> Iterator[Block]:
    """The same samples in Blocks of at most so many."""
    for block in blocks:
        for first in range(0, len(block), samples):
            yield block.cut(first, first + samples)
