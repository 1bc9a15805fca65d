"""What a PLC or a server may show instead of what it should: batches that are true, or one clear sentence."""

from __future__ import annotations

import os
import random
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Channel, SourceError
from livebode_drives.live.ads import FILETIME_1970, HEADER, MAGIC, Ring, new_rows, read_ring, ring_batch
from livebode_drives.live.opcua import INCOMPLETE_MAX, StampCollector
from livebode_drives.live.stamp_numbers import StampNumbers
from tests.support.damaged_bytes import damaged, one_sentence
from tests.support.errors import refused

CASES = int(os.environ.get("LIVEBODE_LIVE_FUZZ", "10000"))
CHANNELS = (Channel("w", "N m"), Channel("y", "rad/s"))
LENGTH = 64
NOW = datetime(2024, 1, 1, tzinfo=UTC)


def header(count: int = 100, **changes: float) -> Ring:
    return replace(Ring(MAGIC, 1, 2, LENGTH, 7, 4000.0, FILETIME_1970 + 10**10, count), **changes)


def packed(ring: Ring) -> bytes:
    return HEADER.pack(*ring.__dict__.values())


def test_damaged_rings_give_batches_or_a_sentence():
    rng, size, read = random.Random(1), HEADER.size + LENGTH * 16, 0
    for _ in range(CASES):
        raw = damaged(packed(header(rng.randrange(300))), rng)
        try:
            ring, dtype = read_ring(raw, size)
            for first, last in new_rows(ring, rng.choice([None, 0, 50, 10**6])):
                assert 0 < last - first < ring.length
                assert first % ring.length + last - first <= ring.length
                rows = bytes((last - first) * ring.channels * dtype.itemsize)
                batch = ring_batch(rows, first, ring, header(ring.count + rng.randrange(100)), dtype, CHANNELS)
                read += batch is not None
        except SourceError as error:
            one_sentence(error)
    assert read > CASES // 20


@given(count=st.integers(0, 500), have=st.none() | st.integers(0, 500), more=st.integers(0, 200), wide=st.booleans())
def test_a_ring_gives_only_samples_that_were_not_overwritten(count, have, more, wide):
    """The PLC goes on writing while the ring is read: rows may be newer than their number, and must not come out."""
    dtype = np.dtype("<f8" if wide else "<f4")
    before, after = header(count), header(count + more)
    slots = np.arange(LENGTH)
    newest = after.count - ((after.count - slots) % LENGTH)  # the slot that is written next may be half written
    stands = np.stack([newest, -newest], axis=1).astype(dtype)
    found = []
    for first, last in new_rows(before, have):
        raw = stands[first % LENGTH : first % LENGTH + last - first].tobytes()
        batch = ring_batch(raw, first, before, after, dtype, CHANNELS)
        if batch is not None:
            np.testing.assert_array_equal(batch.data[0], np.arange(batch.first_sample, batch.stop))
            found += batch.data[0].tolist()
    oldest = max(after.count - LENGTH + 1, 0 if have is None or have > count else have)
    assert found == list(range(oldest, count))


@pytest.mark.parametrize(
    ("ring", "size", "facts"),
    [
        (header(magic=1), 1064, {"beginning": "010000000100"}),
        (header(version=2), 1064, {"beginning": "4c524e470200"}),
        (header(channels=0), 1064, {"channels": 0}),
        (header(length=2**32 - 1), 1064, {"samples": 2**32 - 1}),
        (header(rate_hz=float("inf")), 1064, {"rate_hz": float("inf")}),
        (header(), 1065, {"bytes": 1065, "samples": LENGTH, "channels": 2}),
    ],
)
def test_rings_that_are_refused(ring, size, facts):
    with refused(SourceError, "ring-invalid", **facts):
        read_ring(packed(ring), size)


@given(st.lists(st.floats(-0.2, 0.2), min_size=2, max_size=200))
def test_jitter_of_stamps_makes_neither_gaps_nor_repeats(jitter):
    numbered = StampNumbers(CHANNELS, 4000.0)
    row = np.zeros(2).tobytes()
    samples = [numbered.sample(1.7e9 + (k + e) / 4000.0, row) for k, e in enumerate(jitter)]
    assert len(numbered.batches(samples)) == 1


VALUES = [
    1, 2.5, True, None, "text", b"raw", [], [1.0, 2.0], [1.0, float("nan")], [None], ["1"], [[1.0]], [1.0] * 5,
    10**400, [10**400], -1, 2**70, {"a": 1}, datetime(2024, 1, 1, tzinfo=UTC), [1 + 2j], (1.0, 2.0),
]  # fmt: skip


def test_any_value_of_an_opc_ua_variant_gives_a_batch_or_a_sentence():
    rng = random.Random(2)
    gathered = StampCollector({"w [N m]": "a", "y": "b"}, 4000.0, "n")
    found = 0
    for _ in range(CASES):
        stamp = rng.choice([None, NOW + timedelta(milliseconds=rng.randrange(100)), datetime(1601, 1, 1)])
        key = rng.choice("abn")
        value = rng.choice([rng.choice(VALUES), rng.randrange(1000) if key == "n" else [1.0, 2.0]])
        try:
            found += gathered.add(key, value, stamp) is not None
        except SourceError as error:
            one_sentence(error)
        assert len(gathered._moments) <= INCOMPLETE_MAX
    assert found > CASES // 100
