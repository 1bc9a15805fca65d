"""A stream that is cut anywhere by a snapshot, and continued by another sequencer, gives the same Blocks and Events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Channel, SpectraLayout
from livebode.sources.live import (
    AnyBatch,
    Batch,
    ClockReading,
    LiveBlock,
    LiveSpectra,
    Position,
    Sequencer,
    SourceEvents,
    SpectraBatch,
)
from tests.support.stateful import bits

RATE_HZ, HOP, WINDOW = 1000.0, 20, 60
CHANNELS = (Channel("w", "N m"), Channel("y", "rpm", "velocity"))
LAYOUT = SpectraLayout(CHANNELS, (Channel("x", "m"),), WINDOW, HOP, lines=(2, 4), quiet=(5,), subtracted=(0.1, 7.0))
Make = Callable[[int, int, int], AnyBatch]


def samples(first: int, hops: int, epoch: int) -> Batch:
    data = np.arange(first * HOP, (first + hops) * HOP) / np.array([[3.0], [-7.0]])
    mark = {"name": "a.csv", "offset": first}
    return Batch(first * HOP, data, CHANNELS, RATE_HZ, epoch, 1e9 + 0.02 * first, mark=mark)


def spectra(first: int, hops: int, epoch: int) -> SpectraBatch:
    number = np.arange(first, first + hops) / 3.0
    sums = np.broadcast_to(number[:, np.newaxis], (2, hops, 3)) * np.array([1 + 2j, -3j])[:, np.newaxis, np.newaxis]
    state = np.arange(hops).astype(np.uint32)
    return SpectraBatch(first * HOP, sums, number[np.newaxis], state, LAYOUT, RATE_HZ, epoch, 1e9 + 0.02 * first)


def strange(batch: AnyBatch, kind: str) -> AnyBatch:
    """With a clock that was set, another rate, or other channels."""
    if kind == "clock":
        return replace(batch, stamp_s=2e9)
    if kind == "rate":
        return replace(batch, rate_hz=2 * RATE_HZ)
    if kind == "channels" and isinstance(batch, Batch):
        return replace(batch, channels=batch.channels[::-1], data=batch.data[::-1].copy())
    return batch


@st.composite
def streams(draw: st.DrawFn, make: Make) -> list[AnyBatch]:
    """Stretches of several epochs that continue, leave out, go back, jump far ahead or begin again, displaced."""
    batches: list[AnyBatch] = []
    at, epoch = draw(st.integers(0, 10**9)), draw(st.integers(0, 2))
    for _ in range(draw(st.integers(1, 6))):
        how = draw(st.sampled_from(["on", "gap", "back", "ahead", "again", "epoch", "epoch", "epoch"]))
        at = {"on": at, "gap": at + 3, "back": max(0, at - 40), "ahead": at + 40_000, "again": 5, "epoch": at}[how]
        epoch = 3 - epoch if how == "epoch" else epoch
        kind = draw(st.sampled_from(["", "", "", "clock", "rate", "channels"]))
        for _ in range(draw(st.integers(1, 14))):
            hops = draw(st.integers(1, 3))
            batches.append(strange(make(at, hops, epoch), kind))
            at += hops
    for _ in range(draw(st.integers(0, 6))):
        place, to = (draw(st.integers(0, len(batches) - 1)) for _ in range(2))
        batches.insert(to, batches[place] if draw(st.booleans()) else batches.pop(place))
    arrived = 0.0
    for place, batch in enumerate(batches):
        arrived += draw(st.sampled_from([0.0, 0.02, 2.0]))
        batches[place] = replace(batch, arrived_s=arrived)
    return batches


def sequencer(begun: Position | None, reorder: int) -> tuple[Sequencer, SourceEvents]:
    later = count(step=1000)  # no Event is left out for its rate
    events = SourceEvents(clock=lambda: float(next(later)))
    made = Sequencer(events, reorder=reorder, rate_hz=RATE_HZ, sender_numbers=reorder % 2 == 1)
    if begun is not None:
        made.resume(begun, paced=False)  # paced: with an estimate by the clocks of this computer
    return made, events


def passed(batches: Sequence[AnyBatch], cuts: set[int], begun: Position | None, reorder: int) -> list[object]:
    """What comes out of each step, by a new sequencer from each cut on."""
    stage, events = sequencer(begun, reorder)
    steps: list[object] = []
    for place, batch in enumerate(batches):
        if place in cuts:
            snapshot = stage.snapshot()
            stage, events = sequencer(None, reorder)
            stage.restore(snapshot)
            assert stage.snapshot() == snapshot
        blocks = [*stage.poll(batch.arrived_s), *stage.push(batch)]
        steps.append(([content(block) for block in blocks], [bits(event) for event in events.take()]))
    last = [content(block) for block in stage.finish()]
    return [*steps, last, stage.lost, stage.first_sample, stage.snapshot()]


def content(block: LiveBlock) -> object:
    sums = (block.sums.tobytes(), block.state.tobytes(), block.place) if isinstance(block, LiveSpectra) else ()
    times = (block.arrived_s, block.start, block.gap, block.origin)
    return block.data.tobytes(), block.channels, block.rate_hz, times, sums


@settings(deadline=None, max_examples=120)
@given(st.data(), st.sampled_from([samples, spectra]), st.integers(0, 5), st.booleans())
def test_a_cut_stream_is_the_uninterrupted_one(data: st.DataObject, make: Make, reorder: int, resumed: bool) -> None:
    batches = data.draw(streams(make))
    cuts = data.draw(st.sets(st.integers(0, len(batches) - 1), min_size=1))
    clock = ClockReading(1e9, 50.0, "a")
    begun = Position(40, batches[0].epoch, batches[0].first_sample, RATE_HZ, clock, {"at": 1}) if resumed else None
    assert passed(batches, cuts, begun, reorder) == passed(batches, set(), begun, reorder)
