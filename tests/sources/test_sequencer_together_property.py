"""Batches that waited are one Block, with the bits, numbers and events of one by one, and leave the same state."""

from __future__ import annotations

from dataclasses import asdict
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Channel, SpectraLayout
from livebode.sources.live import (
    AnyBatch,
    Batch,
    LiveBlock,
    LiveSpectra,
    Sequencer,
    SourceEvents,
    SpectraBatch,
    join_blocks,
)
from tests.support.displaced import displaced

CHANNELS = (Channel("w", "N m"), Channel("y"))
LAYOUT = SpectraLayout(CHANNELS, (Channel("x", "m"),), 60, 20, lines=(2, 4, 5, 7, 9))
RATE_HZ = 4000.0


def batch_of(spectra: bool, first: int, stop: int, epoch: int, stamped: bool) -> AnyBatch:
    rng = np.random.default_rng([first, epoch])
    if not spectra:
        stamp_s = 1e9 + first / RATE_HZ if stamped else None
        data = rng.standard_normal((2, stop - first))
        return Batch(first, data, CHANNELS, RATE_HZ, epoch, stamp_s, first / RATE_HZ, {"at": first})
    count = stop - first
    sums = rng.standard_normal((2, count, 5)) + 1j * rng.standard_normal((2, count, 5))
    state = rng.integers(0, 4, count).astype(np.uint32)
    values = rng.standard_normal((1, count))
    return SpectraBatch(20 * first, sums, values, state, LAYOUT, RATE_HZ, epoch, None, first / RATE_HZ)


def plain(blocks: list[LiveBlock]) -> list[tuple[object, ...]]:
    return [
        (b.start, b.gap, b.arrived_s, b.origin, b.channels, b.data.tobytes())
        + ((b.sums.tobytes(), b.state.tobytes(), b.place) if isinstance(b, LiveSpectra) else ())
        for b in blocks
    ]


@settings(deadline=None, max_examples=60)
@given(
    spectra=st.booleans(),
    stamped=st.booleans(),
    lengths=st.lists(st.integers(1, 5), min_size=3, max_size=30),
    bound=st.integers(0, 3),
    restart=st.integers(0, 40),
    data=st.data(),
)
def test_batches_that_wait_give_the_blocks_of_one_by_one(spectra, stamped, lengths, bound, restart, data):
    edges = [0, *np.cumsum(lengths).tolist()]
    sent = [batch_of(spectra, a, b, 1 + (number >= restart), stamped) for number, (a, b) in enumerate(pairwise(edges))]
    kept = [batch for batch in sent if not data.draw(st.sampled_from([0, 0, 0, 0, 1]))] or sent
    order, cuts = displaced(kept, bound, data), data.draw(st.lists(st.integers(0, len(kept)), max_size=6))
    events = SourceEvents(), SourceEvents()
    single, together = (Sequencer(one, reorder=bound) for one in events)
    for a, b in pairwise([0, *sorted(cuts), len(order)]):
        one_by_one = join_blocks([block for batch in order[a:b] for block in single.push(batch)])
        assert plain(together.push_together(order[a:b])) == plain(one_by_one)
        assert together.snapshot() == single.snapshot()
    assert plain(together.finish()) == plain(single.finish())
    assert [asdict(event) for event in events[1].take()] == [asdict(event) for event in events[0].take()]


def test_batches_of_many_values_are_not_joined_before_they_are_checked() -> None:
    sent = [Batch(first, np.zeros((2, 400_000)), CHANNELS, 4e6, 1) for first in (0, 400_000, 800_000)]
    sequencer = Sequencer(SourceEvents(), reorder=0)
    assert [(block.start, len(block)) for block in sequencer.push_together(sent)] == [(0, 1_200_000)]
