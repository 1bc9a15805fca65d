"""Any cutting into Blocks, and any stop and restart, gives the same corrected Responses, bit for bit."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode import Lines, LivebodeError, MotionCorrection, Responses, Settings, Tracker, multisine
from livebode.core import Block, Event
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Strokes
from tests.support.responses import assert_same

RATE_HZ, WINDOW, CHUNK, JUMP = 4000.0, 200, 2400, 7000
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=WINDOW)
SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", hop=20)


@cache
def record() -> Block:
    """Two fast strokes with dry friction, a sample that is not finite, and one that is a broken telegram."""
    motion = Strokes(start_m=0.4, end_m=1.2, speed_m_per_s=1.0)
    sensor, friction = Sensor(noise_rad_per_s=0.1), Friction(load_coulomb_n=15.0)
    axis = BeltAxis(motion=motion, excitation_n_m=multisine(LINES), sensor=sensor, friction=friction, seconds=2.7)
    block = SimulatedAxis(axis).run()[0]
    data = block.data.copy()
    data[block.index("velocity"), 3100] = np.nan
    data[block.index("u"), 4005] = 1e40
    return Block(data, block.channels, RATE_HZ, start=17)


def pieces(at: list[int], jump: int) -> list[Block]:
    """The record in pieces, with samples missing before number JUMP."""
    block = record()
    edges = sorted({0, len(block), JUMP, *at})
    cut = [block.cut(a, b) for a, b in pairwise(edges)]
    late = [jump * (p.start >= JUMP + 17) for p in cut]
    return [
        Block(p.data, p.channels, RATE_HZ, p.start + n, gap=n > 0 and p.start == JUMP + 17) for p, n in zip(cut, late)
    ]


def new(**options: object) -> MotionCorrection:
    return MotionCorrection(SETTINGS, **({"radius_m": 0.019, "chunk_samples": CHUNK} | options))


def finished(correction: MotionCorrection, blocks: list[Block]) -> tuple[Responses, list[Event]]:
    events: list[Event] = []
    parts = [correction.process(b, events.append) for b in blocks]
    parts.append(correction.finish(events.append))
    return Responses.join(parts), sorted(events, key=lambda event: event.sample)


@cache
def whole(jump: int) -> tuple[Responses, list[Event], dict[str, int]]:
    correction = new()
    return *finished(correction, pieces([], jump)), correction.counts


cuts = st.lists(st.integers(1, len(record()) - 1), max_size=10)


@settings(max_examples=7, deadline=None)
@given(at=cuts, jump=st.sampled_from([0, 23]))
def test_any_cut_gives_the_same_bits(at: list[int], jump: int) -> None:
    correction = new()
    responses, events, counts = whole(jump)
    found, again = finished(correction, pieces(at, jump))
    assert_same(found, responses)
    assert again == events
    assert correction.counts == counts
    kinds = {event.kind for event in events}
    assert kinds == {"held", "non-finite", "implausible"} | ({"gap"} if jump else set())


@settings(max_examples=5, deadline=None)
@given(at=cuts, jump=st.sampled_from([0, 23]))
def test_a_restored_correction_continues_with_the_same_bits(at: list[int], jump: int) -> None:
    correction, parts, events = new(), [], []
    for block in pieces(at, jump):
        parts.append(correction.process(block, events.append))
        snapshot = correction.snapshot()
        correction = new()
        correction.restore(snapshot)
        assert correction.snapshot() == snapshot
    parts.append(correction.finish(events.append))
    responses, expected, counts = whole(jump)
    assert_same(Responses.join(parts), responses)
    assert sorted(events, key=lambda event: event.sample) == expected
    assert correction.counts == counts


def test_samples_and_validity_are_those_of_the_tracker_but_for_friction() -> None:
    tracker = Tracker(SETTINGS)
    plain = Responses.join([tracker.process(b) for b in pieces([], 23)])
    ours = whole(23)[0]
    for name in ("sample", "first", "time_s", "schedule", "coherence"):
        assert np.array_equal(getattr(ours, name), getattr(plain, name), equal_nan=True), name
    assert not np.any(ours.valid & ~plain.valid)


def test_memory_is_that_of_a_chunk_whatever_the_blocks() -> None:
    samples = CHUNK + WINDOW + 0.5 * RATE_HZ
    rows = (CHUNK + 2 * WINDOW) / SETTINGS.step
    most = 8 * (4 * samples + 6 * len(LINES) * rows) + 100_000  # and what the trackers keep, whatever the samples
    sizes = []
    for block in (record(), record().cut(0, 9000)):
        correction = new()
        for at in range(0, len(block), 300):
            correction.process(block.cut(at, at + 300))
            sizes.append(len(correction.snapshot()))
        correction = new()
        correction.process(block)
        sizes.append(len(correction.snapshot()))
    assert max(sizes) < most


def test_a_damaged_or_foreign_snapshot_is_refused_and_changes_nothing() -> None:
    correction = new()
    correction.process(record().cut(0, 6000))
    good = correction.snapshot()
    for size in (0, 1, len(good) // 2, len(good) - 1):
        with pytest.raises(LivebodeError, match="snapshot"):
            correction.restore(good[:size])
    for other in (new(radius_m=0.02), new(chunk_samples=CHUNK + 1), new(stiffness_splines=6)):
        with pytest.raises(LivebodeError, match="other settings"):
            correction.restore(other.snapshot())
    with pytest.raises(LivebodeError, match="other settings"):
        correction.restore(Tracker(SETTINGS).snapshot())
    assert correction.snapshot() == good


def test_samples_that_come_twice_are_refused_and_change_nothing() -> None:
    correction = new()
    correction.process(record().cut(0, 6000))
    good = correction.snapshot()
    with pytest.raises(LivebodeError, match="came twice"):
        correction.process(record().cut(5000, 6000))
    assert correction.snapshot() == good
