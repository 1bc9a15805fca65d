"""Batches in any order that the bound allows come out as they were taken; what is lost is exactly the gaps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Channel
from livebode.sources.live import Batch, ClockReading, LiveBlock, Position, Sequencer, SourceEvents
from livebode.sources.live.computer_clock import pause
from livebode.sources.live.source_events import BURST
from tests.support.displaced import displaced

CHANNELS = (Channel("w", "N m"), Channel("y", "rad/s"))
RATE_HZ = 4000.0


def stream(lengths: list[int], first: int = 0, epoch: int = 1, stamp_s: float | None = None) -> list[Batch]:
    """Batches of these lengths; the value of a sample is its number, and minus it in the second channel."""
    edges = first + np.concatenate([[0], np.cumsum(lengths)])
    return [
        Batch(
            int(a),
            np.arange(a, b) * np.array([[1.0], [-1.0]]),
            CHANNELS,
            RATE_HZ,
            epoch,
            None if stamp_s is None else stamp_s + (a - first) / RATE_HZ,
            arrived_s=0.0,
        )
        for a, b in pairwise(edges)
    ]


def passed(batches: list[Batch], events: SourceEvents | None = None, **options: int) -> list[LiveBlock]:
    sequencer = Sequencer(events or SourceEvents(), **options)
    return [block for batch in batches for block in sequencer.push(batch)] + sequencer.finish()


def content(blocks: list[LiveBlock]) -> list[tuple[int, bool, bytes]]:
    return [(block.start, block.gap, block.data.tobytes()) for block in blocks]


@settings(deadline=None)
@given(
    lengths=st.lists(st.integers(1, 5), min_size=1, max_size=25),
    first=st.integers(0, 10**12),
    bound=st.integers(0, 8),
    data=st.data(),
)
def test_reordering_within_the_bound_and_repeats_change_nothing(lengths, first, bound, data):
    batches = stream(lengths, first)
    order = displaced(batches, bound, data)
    for _ in range(data.draw(st.integers(0, 20))):
        again = data.draw(st.integers(0, len(order) - 1))
        order.insert(data.draw(st.integers(again, len(order))), order[again])
    events = SourceEvents()
    blocks = passed(order, events, reorder=bound)
    assert content(blocks) == content(passed(batches, reorder=bound))
    assert [b.start for b in blocks] == [b.first_sample - first for b in batches]
    assert events.counts["repeat"] == len(order) - len(batches)
    assert events.counts["loss"] == events.counts["restart"] == events.counts["foreign"] == 0
    latest, late = -1, 0
    for at in dict.fromkeys(b.first_sample for b in order):
        late += at < latest
        latest = max(latest, at)
    assert events.counts["reordered"] == late


@settings(deadline=None)
@given(
    lengths=st.lists(st.integers(1, 5), min_size=3, max_size=40),
    bound=st.integers(0, 6),
    data=st.data(),
)
def test_lost_batches_are_exactly_the_gaps(lengths, bound, data):
    batches = stream(lengths, 7)
    lost = data.draw(st.sets(st.integers(1, len(batches) - 2)))
    kept = [batch for i, batch in enumerate(batches) if i not in lost]
    events = SourceEvents()
    blocks = passed(displaced(kept, bound, data), events, reorder=bound)
    truth = [(b.first_sample - 7, b.data.tobytes()) for b in kept]
    assert [(b.start, b.data.tobytes()) for b in blocks] == truth
    assert [b.gap for b in blocks] == [False, *(a.stop != b.first_sample for a, b in pairwise(kept))]
    events = [event for event in events.take() if event.kind == "loss"]
    missing = [b.first_sample - a.stop for a, b in pairwise(kept) if a.stop != b.first_sample]
    assert [event.details["missing_samples"] for event in events] == missing
    assert [event.sample for event in events] == [b.start for b in blocks if b.gap]


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 60), st.integers(1, 9)), min_size=1, max_size=60), st.integers(0, 8))
def test_any_overlapping_batches_give_correct_ascending_samples(pieces, bound):
    """Batches that overlap, repeat and leave holes as they like: every sample that comes out is at its place, once."""
    batches = [stream([length], first)[0] for first, length in pieces]
    blocks = passed(batches, reorder=bound)
    numbers = np.concatenate([block.data[0] for block in blocks]) if blocks else np.empty(0)
    places = np.concatenate([np.arange(block.start, block.stop) for block in blocks]) if blocks else np.empty(0)
    assert np.all(np.diff(places) > 0)
    if len(batches) < 32:  # else numbers that go back may be a restart
        assert np.all(np.diff(numbers) == np.diff(places))


def test_a_missing_batch_is_waited_for_no_longer_than_its_time():
    a, _, c = stream([4, 4, 4])
    sequencer = Sequencer(SourceEvents(), reorder=8, wait_s=1.0)
    assert sequencer.push(a) == []
    assert len(sequencer.poll(1.1)) == 1
    assert sequencer.push(replace(c, arrived_s=2.0)) == []
    assert sequencer.poll(2.9) == []
    (block,) = sequencer.poll(3.1)
    assert (block.start, block.gap, sequencer.lost) == (8, True, 4)


@pytest.mark.parametrize("epoch", [2, 1])
@pytest.mark.parametrize("reorder", [0, 4])
def test_a_restart_is_a_gap_of_unknown_length_and_loses_nothing(epoch, reorder):
    """With a new epoch at once; without one when the numbers begin anew far enough back."""
    old, new = stream([100] * 5000, 1000), stream([100] * 20, 0, epoch)
    events = SourceEvents()
    blocks = passed(old + new, events, reorder=reorder)
    assert np.array_equal(np.concatenate([b.data[0] for b in blocks[5000:]]), np.arange(2000))
    assert [b.gap for b in blocks[4999:5002]] == [False, True, False]
    assert [b.start for b in blocks[4999:5002]] == [499_900, 500_000, 500_100]
    assert events.counts["restart"] == 1
    assert events.counts["loss"] == events.counts["repeat"] == events.counts["clock-jump"] == 0


def test_a_restart_soon_after_the_start_without_an_epoch():
    events = SourceEvents()
    blocks = passed(stream([10] * 100) + stream([10] * 100), events)
    assert [block.gap for block in blocks].count(True) == events.counts["restart"] == 1
    assert sum(map(len, blocks)) == 2000
    assert events.counts["repeat"] == 0


def test_a_second_sender_is_dropped_and_named_while_the_first_one_sends():
    a, b = stream([10] * 50, 0, 1), stream([10] * 50, 0, 2)
    events = SourceEvents()
    blocks = passed([batch for pair in zip(a, b) for batch in pair], events, reorder=0)
    assert content(blocks) == content(passed(a, reorder=0))
    assert (events.counts["restart"], events.counts["foreign"]) == (0, 50)
    details = events.take()[0].details
    assert (details["epoch"], details["sender_sample"]) == ("0x2", 0)


@settings(deadline=None)
@given(st.integers(0, 8), st.integers(2, 6), st.integers(30, 50))
def test_two_batches_of_another_epoch_do_not_lock_the_sender_out(reorder, strange, at):
    """It is trusted again, with its own numbers: all but what the other one's samples stand for is there, in time."""
    good = stream([10] * 100, 1000, 1)
    events = SourceEvents()
    blocks = passed(good[:at] + stream([10] * strange, 7, 2) + good[at:], events, reorder=reorder)
    mine = [block for block in blocks if block.origin.epoch == 1]
    found = np.concatenate([block.data[0] for block in mine])
    assert np.array_equal(found, np.concatenate([np.arange(block.start, block.stop) for block in mine]) + 1000)
    assert found[-1] == 1999
    assert len(found) == 1000 - 10 * strange
    back = [event for event in events.take() if event.kind == "restart"]
    assert [event.details["epoch"] for event in back] == ["0x2", "0x1"]
    assert back[1].details["lost_samples"] == 10 * strange
    assert "set its address in source.sender" in back[1].message


@settings(deadline=None)
@given(st.integers(0, 8), st.integers(1, 2), st.integers(20, 40))
def test_batches_half_an_hour_ahead_are_rejected_while_the_stream_continues(reorder, strange, at):
    good = stream([10] * 60, 1000)
    ahead = stream([10] * strange, 1000 + int(1800 * RATE_HZ))
    events = SourceEvents()
    blocks = passed(good[:at] + ahead + good[at:], events, reorder=reorder)
    assert content(blocks) == content(passed(good, reorder=reorder))
    assert {kind: count for kind, count in events.counts.items() if count} == {"foreign": strange}


@pytest.mark.parametrize("reorder", [0, 8])
def test_a_real_jump_of_half_an_hour_is_a_loss_of_exactly_so_long(reorder):
    jump = int(1800 * RATE_HZ)
    a, b = stream([10] * 40, 1000), stream([10] * 40, 1400 + jump)
    events = SourceEvents()
    blocks = passed(a + b, events, reorder=reorder)
    assert np.array_equal(
        np.concatenate([block.data[0] for block in blocks]), np.r_[1000:1400, 1400 + jump : 1800 + jump]
    )
    (event,) = events.take()
    assert (event.kind, event.details["missing_samples"], event.sample) == ("loss", jump, 400 + jump)


@pytest.fixture
def no_time_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """An estimate by the computer's clocks is then exact; else it has the time between two looks at them."""
    clocks = {"monotonic": lambda: 100.0, "time": lambda: 1.8e9, "clock_gettime": lambda _: 100.0, "CLOCK_MONOTONIC": 1}
    monkeypatch.setattr("livebode.sources.live.computer_clock.time", SimpleNamespace(**clocks))


def left_at(sample: int, number: int, epoch: int, away_s: float) -> Position:
    """A stream that was left so long before the batches here arrive, which is at 0."""
    now = ClockReading.at(0.0)
    return Position(sample, epoch, number, RATE_HZ, ClockReading(now.unix_s - away_s, now.uptime_s - away_s, now.boot))


def resumed(position: Position, batches: list[Batch], events: SourceEvents, **options: int) -> list[LiveBlock]:
    sequencer = Sequencer(events, **options)
    sequencer.resume(position)
    return [block for batch in batches for block in sequencer.push(batch)] + sequencer.finish()


@settings(deadline=None)
@given(st.sampled_from([0, 1]), st.integers(0, 8), st.integers(0, 40_000), st.integers(0, 300))
def test_a_stream_continues_by_the_numbers_of_the_sender_whatever_the_clock(epoch, reorder, missing, again):
    """A broker that kept what came in 20 s, and gives some of it again, as well as a sender that was not heard."""
    again -= again % 10
    position = left_at(5000, 105_000, epoch, 20.0)
    batches = stream([10] * (again // 10 + 40), 105_000 + missing - again if missing == 0 else 105_000 + missing, epoch)
    if epoch == 0 and missing == 0:
        batches = batches[again // 10 :]
    events = SourceEvents()
    blocks = resumed(position, batches, events, reorder=reorder)
    number = np.concatenate([np.arange(block.start, block.stop) for block in blocks])
    assert np.array_equal(np.concatenate([block.data[0] for block in blocks]), number + 100_000)
    assert number[0] == 5000 + missing
    losses = [event.details["missing_samples"] for event in events.take() if event.kind == "loss"]
    assert losses == ([missing] if missing else [])
    assert events.counts["restart"] == 0


@pytest.mark.usefixtures("no_time_passes")
@pytest.mark.parametrize("epoch", [0, 2])
def test_the_gap_of_a_restarted_sender_is_estimated_by_the_computers_clock(epoch):
    position = left_at(5000, 905_000, 0 if epoch == 0 else 1, 20.0)
    events = SourceEvents()
    blocks = resumed(position, stream([10] * 60, 0, epoch), events, reorder=0)
    assert (blocks[0].start, blocks[0].gap) == (5000 + 20 * RATE_HZ - 10, True)
    (event,) = events.take()
    assert event.kind == "restart"
    assert "which is an estimate" in event.message
    assert event.details["estimated_samples"] == 20 * RATE_HZ - 10


@pytest.mark.usefixtures("no_time_passes")
def test_numbers_of_a_sender_without_epoch_that_the_clock_contradicts_are_a_restart():
    """It cannot have sent five minutes in 20 s."""
    events = SourceEvents()
    blocks = resumed(left_at(5000, 105_000, 0, 20.0), stream([10] * 40, 1_305_000, 0), events, reorder=0)
    assert blocks[0].start == 5000 + 20 * RATE_HZ - 10
    assert events.counts["restart"] == 1


YEARS = 10 * 365 * 86400.0


@pytest.mark.parametrize(("step_s", "boot"), [(YEARS, "a"), (-3600.0, "a"), (YEARS, "b"), (-3600.0, "b"), (0.0, "b")])
def test_a_computer_clock_that_is_wrong_is_not_used_and_named(step_s, boot):
    """Since the computer's start the time is known from another clock; over a start of it there is none."""
    before = ClockReading(1.8e9, 1000.0, "a")
    now = ClockReading(1.8e9 + 20.0 + step_s, 1020.0 if boot == "a" else 5.0, boot)
    found = pause(before, now)
    assert found.seconds == (20.0 if boot == "a" or step_s == 0.0 else None)
    assert ("set its date and time" in found.remark or "check its date and time" in found.remark) == (step_s != 0.0)


def test_one_stray_batch_far_away_does_not_derail_the_stream():
    batches = stream([10] * 50)
    stray = stream([10], 10**15)
    events = SourceEvents()
    blocks = passed(batches[:20] + stray + batches[20:], events, reorder=3)
    assert content(blocks) == content(passed(batches, reorder=3))
    assert events.counts["foreign"] == 1


def counts_of(batches: list[Batch], **options: float) -> dict[str, int]:
    events = SourceEvents()
    passed(batches, events, **options)
    return {kind: count for kind, count in events.counts.items() if count}


def test_each_fault_of_a_stream_is_counted_as_its_own_kind():
    """Each fault alone gives its own kind and no other."""
    good = stream([100] * 40, stamp_s=1e9)
    assert counts_of(good) == {}
    set_clock = [replace(b, stamp_s=b.stamp_s + 3600 * (i >= 20)) for i, b in enumerate(good)]
    assert counts_of(set_clock) == {"clock-jump": 1}
    twice_as_fast = [replace(b, stamp_s=1e9 + b.first_sample / 8000) for b in good]
    assert counts_of(twice_as_fast) == {"wrong-rate": 1}
    slow_batches = stream([8000] * 20, stamp_s=1e9)
    assert counts_of([replace(b, stamp_s=1e9 + b.first_sample / 2000) for b in slow_batches]) == {"wrong-rate": 1}
    stated = [replace(b, rate_hz=8000.0) if i >= 20 else b for i, b in enumerate(good)]
    assert counts_of(stated) == {"wrong-rate": 1}
    renamed = [replace(b, channels=(CHANNELS[0], Channel("z"))) if i >= 20 else b for i, b in enumerate(good)]
    assert counts_of(renamed) == {"layout-changed": 1}
    scaled = [replace(b, channels=(CHANNELS[0], Channel("y", "rpm"))) if i >= 20 else b for i, b in enumerate(good)]
    assert counts_of(scaled) == {"unit-changed": 1}
    assert counts_of(good[:20] + stream([100] * 20, 0, 2, stamp_s=1e9 + 60)) == {"restart": 1}
    assert counts_of(good[:20] + good[21:]) == {"loss": 1}
    assert counts_of([*good[:20], good[21], good[20], *good[22:]]) == {"reordered": 1}
    assert counts_of([*good[:20], good[19], *good[20:]]) == {"repeat": 1}


def test_a_rate_that_is_a_little_wrong_shows_after_ten_seconds():
    batches = stream([400] * 200, stamp_s=1e9)
    rng = np.random.default_rng(0)
    jitter = rng.normal(scale=1e-3, size=200)
    assert counts_of([replace(b, stamp_s=b.stamp_s + e) for b, e in zip(batches, jitter)]) == {}
    off = [replace(b, stamp_s=1e9 + b.first_sample / 4010 + e) for b, e in zip(batches, jitter)]
    events = SourceEvents()
    passed(off, events)
    (event,) = events.take()
    assert event.kind == "wrong-rate"
    assert event.details["measured_hz"] == pytest.approx(4010, abs=1)


def test_changed_layouts_that_still_hold_the_channels_are_taken_by_name():
    good = stream([10] * 20)
    wider = (*reversed(CHANNELS), Channel("extra", "V"))
    changed = [
        replace(b, channels=wider, data=np.vstack([b.data[1], b.data[0], b.data[0] * 0])) if i >= 10 else b
        for i, b in enumerate(good)
    ]
    events = SourceEvents()
    assert content(passed(changed, events)) == content(passed(good))
    assert [event.kind for event in events.take()] == ["layout-changed"]


def test_a_flood_of_events_is_counted_and_held_back():
    now = [0.0]
    events = SourceEvents(lambda: now[0])
    for _ in range(100_000):
        events.report("malformed", "x" * 100_000)
    found = events.take()
    assert len(found) == BURST
    assert max(len(event.message) for event in found) <= 500
    now[0] = 1.0
    events.report("malformed", "y")
    (event,) = events.take()
    assert event.details["more"] == 100_000 - BURST
    assert events.counts["malformed"] == 100_001
