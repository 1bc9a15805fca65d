"""Real time: no Block before its last sample would have been measured."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from livebode.nouns import Block


def paced(blocks: Iterable[Block], clock: Callable[[], float], sleep: Callable[[float], object]) -> Iterator[Block]:
    """The same Blocks, each at its time after the first was asked for; a late one is not waited for."""
    began = clock()
    for block in blocks:
        if (wait := began + block.stop / block.rate_hz - clock()) > 0:
            sleep(wait)
        yield block
