"""Blocks that follow each other as one: most of what a tracker costs is by Block, not by sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from livebode.sources.live.batch import Batch, LiveBlock
from livebode.sources.live.position import Origin
from livebode.sources.live.spectra_batch import LATER, AnyBatch, LiveSpectra, SpectraBatch


def join_blocks(blocks: Sequence[LiveBlock]) -> list[LiveBlock]:
    """The same samples or spectra in as few Blocks as possible; a gap begins another one.

    A joined Block has arrived when its last part has.
    """
    parts: list[list[LiveBlock]] = []
    for block in blocks:
        if parts and _continues(parts[-1][-1], block):
            parts[-1].append(block)
        else:
            parts.append([block])
    return [_one(part) for part in parts]


def block_of(batches: Sequence[AnyBatch], number: int) -> LiveBlock:
    """Batches of which one follows the other as one Block that begins at `number`, as `join_blocks` would make it."""
    first, last = batches[0], batches[-1]
    if first is last:
        return first.block(number, first.first_sample, False)
    if isinstance(first, Batch) and isinstance(last, Batch):
        data = np.concatenate([batch.data for batch in batches if isinstance(batch, Batch)], axis=1)
        origin = Origin(first.epoch, first.first_sample - number, last.mark)
        return LiveBlock(data, first.channels, first.rate_hz, start=number, arrived_s=last.arrived_s, origin=origin)
    parts = [batch for batch in batches if isinstance(batch, SpectraBatch)]
    spectra = replace(
        parts[0],
        sums=np.concatenate([part.sums for part in parts], axis=1),
        values=np.concatenate([part.values for part in parts], axis=1),
        state=np.concatenate([part.state for part in parts]),
        arrived_s=last.arrived_s,
        mark=last.mark,
    )
    return spectra.block(number, first.first_sample, False)


def _continues(first: LiveBlock, second: LiveBlock) -> bool:
    if second.gap or second.start != first.stop or second.rate_hz != first.rate_hz:
        return False
    if isinstance(first, LiveSpectra):
        return isinstance(second, LiveSpectra) and second.layout == first.layout
    return not isinstance(second, LiveSpectra) and second.channels == first.channels


def _one(part: list[LiveBlock]) -> LiveBlock:
    first, last = part[0], part[-1]
    if first is last:
        return first
    if not isinstance(first, LiveSpectra):
        data = np.concatenate([block.data for block in part], axis=1)
        return replace(first, data=data, arrived_s=last.arrived_s, origin=last.origin)
    spectra = [block for block in part if isinstance(block, LiveSpectra)]
    return replace(
        first,
        data=LATER,
        values=np.concatenate([block.values for block in spectra], axis=1),
        sums=np.concatenate([block.sums for block in spectra], axis=1),
        state=np.concatenate([block.state for block in spectra]),
        arrived_s=last.arrived_s,
        origin=last.origin,
    )
