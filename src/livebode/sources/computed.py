"""Blocks with computed channels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from livebode.core import Block, Channel
from livebode.sources.expressions import Expression


def computed_blocks(
    blocks: Iterator[Block], names: Sequence[str], expressions: Mapping[str, Expression], labels: Sequence[Channel]
) -> Iterator[Block]:
    """Blocks of the channels `names`, of which `expressions` are computed from other channels of `blocks`.

    A difference is one of two samples: the first samples of the recording, and those behind a gap, are not in it.
    """
    before = max(expression.before for expression in expressions.values())
    held, stop = np.zeros((0, 0)), -1
    for block in blocks:
        follows = block.start == stop and not block.gap
        data = np.concatenate([held, block.data], axis=1) if follows and before else block.data
        signals = dict(zip(block.names, data))
        rows = [
            expressions[name].values(signals, block.rate_hz) if name in expressions else signals[name] for name in names
        ]
        first = block.stop - data.shape[1] + before
        gap = block.gap if not follows else False
        if data.shape[1] > before:
            yield replace(block, data=np.array(rows)[:, before:], channels=tuple(labels), start=first, gap=gap)
        held, stop = data[:, max(data.shape[1] - before, 0) :], block.stop
