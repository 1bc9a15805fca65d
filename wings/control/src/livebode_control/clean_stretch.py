"""Longest stretch of a recording that a computation in time can use."""

from __future__ import annotations

import numpy as np

from livebode.configuration import ReadyCondition
from livebode.core import Block, SignalError
from livebode.sources import Log


def clean_stretch(opened: Log, names: list[str], ready: ReadyCondition | None = None) -> tuple[Block, int]:
    """The longest stretch of a recording without gaps and with finite samples only, and the number of all samples.

    With `ready`, the machine is ready at each of its samples.
    """
    best: list[Block] = []
    now: list[Block] = []
    recorded = 0
    for block in opened.blocks(names if ready is None else list(dict.fromkeys([*names, ready.channel]))):
        recorded += len(block)
        broken = ~np.isfinite(block.data).all(axis=0)
        if ready is not None:
            broken |= ~ready.holds(block[ready.channel])
        edges = np.flatnonzero(np.diff(np.concatenate([[1], broken, [1]])))
        for first, last in zip(edges[::2], edges[1::2]):
            if first > 0 or block.gap or not now or now[-1].stop != block.start:
                now = []
            now.append(block.cut(int(first), int(last)))
            if sum(map(len, now)) > sum(map(len, best)):
                best = list(now)
            if last < len(block):
                now = []
    if not best:
        raise SignalError(
            "no-clean-samples",
            f"{str(opened.path)!r} has no sample at which {', '.join(names)} are all finite",
            "choose another recording",
            path=str(opened.path),
            channels=names,
        )
    data = np.concatenate([b.data for b in best], axis=1)
    return Block(data, best[0].channels, best[0].rate_hz, best[0].start), recorded
