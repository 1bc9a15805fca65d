"""Spectra in any order that the bound allows come out in place, each with the phase that it was computed with."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from livebode.core import Channel, SpectraLayout
from livebode.sources.live import Batch, LiveSpectra, Sequencer, SourceEvents, SpectraBatch
from livebode.sources.live.sequencer import JUMP_S
from tests.support.displaced import displaced

WINDOW, RATE_HZ = 60, 4000.0
SIGNALS, VALUES = (Channel("w", "N m"), Channel("y")), (Channel("x", "m"),)


def layout(hop: int, **options: object) -> SpectraLayout:
    return SpectraLayout(SIGNALS, VALUES, WINDOW, hop, **({"lines": (2, 4)} | options))


def stream(hop: int, lengths: list[int], first: int = 0, epoch: int = 1) -> list[SpectraBatch]:
    """Batches of so many spectra; every sum is the number of its spectrum, counted from sample 0."""
    edges = first + np.concatenate([[0], np.cumsum(lengths)])
    return [made(layout(hop), int(a), int(b), epoch) for a, b in pairwise(edges)]


def made(what: SpectraLayout, a: int, b: int, epoch: int = 1) -> SpectraBatch:
    number = np.arange(a, b, dtype=float)
    sums = np.broadcast_to(number[:, np.newaxis], (2, b - a, 2)).astype(complex)
    state = np.zeros(b - a, np.uint32)
    return SpectraBatch(a * what.hop, sums, number[np.newaxis], state, what, RATE_HZ, epoch, arrived_s=0.0)


def passed(batches: list[SpectraBatch | Batch], source_events: SourceEvents, reorder: int) -> list[LiveSpectra]:
    sequencer = Sequencer(source_events, reorder=reorder)
    return [block for batch in batches for block in sequencer.push(batch)] + sequencer.finish()


hops = st.sampled_from([1, 20, 60, 180])


@settings(deadline=None)
@given(
    hop=hops,
    lengths=st.lists(st.integers(1, 5), min_size=3, max_size=40),
    first=st.integers(0, 10**6),
    bound=st.integers(0, 6),
    data=st.data(),
)
def test_lost_batches_are_exactly_the_gaps_and_phases_are_unchanged(hop, lengths, first, bound, data):
    batches = stream(hop, lengths, first)
    lost = data.draw(st.sets(st.integers(1, len(batches) - 2)))
    kept = [batch for i, batch in enumerate(batches) if i not in lost]
    # A longer jump is believed only when more batches follow it (tests/sources/test_sequencer_truth.py). A batch that
    # is too early makes a jump longer.
    early = [*kept[bound + 1 :], *[kept[-1]] * (bound + 1)]
    assume(max(b.first_sample - a.stop for a, b in zip(kept, early)) <= JUMP_S * RATE_HZ)
    source_events = SourceEvents()
    blocks = passed(displaced(kept, bound, data), source_events, bound)
    assert [block.start for block in blocks] == [batch.first_sample - first * hop for batch in kept]
    assert [b.gap for b in blocks] == [False, *(a.stop != b.first_sample for a, b in pairwise(kept))]
    assert sum(e.details["missing_samples"] for e in source_events.take() if e.kind == "loss") == sum(
        b.first_sample - a.stop for a, b in pairwise(kept)
    )
    for block, batch in zip(blocks, kept):
        np.testing.assert_array_equal(block.sums, batch.sums)
        np.testing.assert_array_equal(block["x"], batch.values[0])
        assert block.place == (batch.first_sample + hop) % WINDOW
        assert block.stop - block.start == batch.samples
        assert (block.sample[-1], len(block.sample)) == (block.stop - 1, len(block))


@settings(deadline=None)
@given(hops, st.lists(st.tuples(st.integers(0, 60), st.integers(1, 9)), min_size=1, max_size=31), st.integers(0, 8))
def test_any_overlapping_batches_give_correct_ascending_spectra(hop, pieces, bound):
    """Batches that overlap, repeat and leave holes as they like: what comes out is at its place, once."""
    blocks = passed([stream(hop, [length], first)[0] for first, length in pieces], SourceEvents(), bound)
    numbers = np.concatenate([block.sums[0, :, 0].real for block in blocks])
    places = np.concatenate([block.sample for block in blocks])
    assert np.all(np.diff(places) > 0)
    assert np.all(np.diff(numbers) * hop == np.diff(places))
    for block in blocks:
        assert block.place == (block.sums[0, 0, 0].real + 1) * hop % WINDOW


def test_a_restart_is_a_gap_and_keeps_the_grid_of_hops():
    source_events = SourceEvents()
    blocks = passed(stream(20, [1] * 50, 1000) + stream(20, [1] * 10, 0, epoch=2), source_events, 4)
    assert [block.gap for block in blocks[49:52]] == [False, True, False]
    assert [block.start for block in blocks[49:52]] == [980, 1000, 1020]
    assert [block.place for block in blocks[50:]] == [20 * n % WINDOW for n in range(1, 11)]
    assert source_events.counts["restart"] == 1


def test_samples_and_other_layouts_in_a_stream_of_spectra_are_left_out_and_reported_once():
    given_, samples = stream(20, [1] * 12), Batch(40, np.zeros((2, 20)), SIGNALS, RATE_HZ, 1, arrived_s=0.0)
    other = made(layout(20, lines=(2, 6)), 4, 5)
    source_events = SourceEvents()
    blocks = passed([*given_[:4], samples, samples, other, other, *given_[4:]], source_events, 0)
    assert [block.start for block in blocks] == list(range(0, 240, 20))
    messages = [event.message for event in source_events.take() if event.kind == "layout-changed"]
    assert messages == [
        "the sender now sends samples; they are skipped until the first layout is back",
        "the sender now sends spectra of another layout; they are skipped until the first layout is back",
    ]
    # The other way round.
    source_events = SourceEvents()
    begun = [replace(samples, first_sample=at) for at in (0, 20)]
    assert len(passed([begun[0], given_[1], begun[1]], source_events, 0)) == 2
    assert [e.message[:31] for e in source_events.take()] == ["the sender now sends spectra; t"]


def test_a_changed_rate_is_reported():
    source_events = SourceEvents()
    first, second = stream(20, [1, 1])
    assert len(passed([first, replace(second, rate_hz=8000.0)], source_events, 0)) == 1
    assert source_events.counts["wrong-rate"] == 1
