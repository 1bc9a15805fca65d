"""Lines of numbers over a serial line that loses, damages and repeats: a sample is right, or it is missing."""

from __future__ import annotations

import random
import time

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from livebode.core import Channel, ConfigError, SourceError
from livebode.sources.live import ClockReading, Position, SourceEvents, SourceSettings, make_source
from livebode_drives.live.arrival_rate import ArrivalRate
from livebode_drives.live.counter import Counter
from livebode_drives.live.serial_line import UNKNOWN_BYTES, FramesOrJson, NumberLines, NumbersDecoder, numbers_in
from tests.support.damaged_bytes import damaged, one_sentence
from tests.support.errors import refused
from tests.support.peers.peer import CHANNELS, PATIENCE_S, RATE_HZ, Feeding, batches, fed
from tests.support.peers.serial_line import SerialNumbersPeer

SETTINGS = {"url": "serial:/nowhere", "channels": ["n", "y [m]"]}
N, Y = Channel("n"), Channel("y", "m")


@given(
    lost=st.lists(st.integers(1, 400), max_size=20),
    kept=st.lists(st.integers(2, 40), min_size=21, max_size=21),
    modulus=st.sampled_from([None, 1 << 8, 1 << 16]),
    first=st.integers(0, 300),
)
def test_every_loss_is_exact_whatever_wraps(lost, kept, modulus, first):
    """More samples than the counter has values may be missing: the time between the samples tells how many."""
    assume(modulus is None or not any(gap % modulus == 0 for gap in lost))  # then the counter shows none
    truth, number = [], first
    for run, gap in zip(kept, [*lost, 0]):
        truth += range(number, number + run)
        number += run + gap
    counter, found = Counter(1000.0, modulus), []
    for number in truth:
        count = number if modulus is None else number % modulus
        found += counter.process(count, 5.0 + number / 1000, np.array([number]))
    assert found
    offset = found[0].row[0] - found[0].number
    assert [sample.row[0] for sample in found] == truth[: len(found)]
    assert {sample.row[0] - sample.number for sample in found} == {offset}
    assert {sample.epoch for sample in found} == {0}
    assert len(found) >= len(truth) - 1  # the last one may wait for the next
    assert counter.damaged == 0


@given(at=st.integers(2, 98), wrong=st.integers(0, 5000), modulus=st.sampled_from([None, 1 << 13]))
def test_a_single_wrong_counter_drops_only_its_sample(at, wrong, modulus):
    counter, found = Counter(1000.0, modulus), []
    for number in range(200, 300):
        count = wrong if number == 200 + at else number
        found += counter.process(count, number / 1000, np.array([number]))
    assert {sample.epoch for sample in found} == {0}
    assert all(sample.number == sample.row[0] for sample in found if sample.row[0] != 200 + at)
    assert {sample.row[0] for sample in found} >= set(range(200, 299)) - {200 + at}


@pytest.mark.parametrize("modulus", [None, 1 << 16])
def test_a_device_that_was_reset_is_another_epoch(modulus):
    counter, found = Counter(1000.0, modulus), []
    for k, count in enumerate([*range(30_000, 30_010), *range(20)]):
        found += counter.process(count, k / 1000, np.array([count]))
    assert [(s.epoch, s.number) for s in found] == [(0, n) for n in range(30_000, 30_010)] + [(1, n) for n in range(20)]


def test_without_a_counter_a_damaged_line_is_one_missing_sample():
    lines = NumberLines((N, Y), 1000.0, None, None, 0)
    decoder = NumbersDecoder(lines)
    found = decoder.feed(b"4,0.5\n0 10\r\n1\t11\n", 0.0)  # the first may be the end of a line
    found += decoder.feed(b"2;1", 0.01) + decoder.feed(b"2\n3,x3\n4,1_4\n5,15,\n6, 16\n", 0.02)
    values = {batch.first_sample + k: batch.data[1, k] for batch in found for k in range(batch.samples)}
    assert values == {0: 10.0, 1: 11.0, 2: 12.0, 6: 16.0}
    assert len(decoder.problems) == 3
    lines.restart()
    assert NumbersDecoder(lines).feed(b"\n9,9\n", 5.0)[0].epoch == 1


def test_damaged_lines_give_batches_or_sentences():
    rng = random.Random(3)
    lines = NumberLines((N, Y), 1000.0, 0, None, 0)
    decoder, found = NumbersDecoder(lines), 0
    for number in range(3000):
        raw = b"%d,%r\n" % (number, number / 7)
        for batch in decoder.feed(damaged(raw, rng) if number % 5 == 0 else raw, number / 1000):
            found += batch.samples
    for problem in decoder.problems:
        if isinstance(problem, SourceError):
            one_sentence(problem)
        else:
            assert "\n" not in str(problem)
    assert 3000 * 0.7 < found <= 3000


def test_a_line_of_something_else_is_reported_and_bounded():
    decoder = FramesOrJson(None)
    for _ in range(100):
        assert decoder.feed(b"0.5,0.25\r\n" * 10, 0.0) == []
    assert len(decoder._start) < UNKNOWN_BYTES
    assert len(decoder.problems) == 10_000 // UNKNOWN_BYTES
    assert "source.channels" in decoder.problems[0]
    text = b'\n{"sample": 0, "channels": ["w"], "rate_hz": 10, "data": [[1, 2]]}\n'
    assert decoder.feed(text, 1.0)[0].samples == 2


def test_a_device_that_is_slower_than_its_rate_is_reported():
    """A line of 20 characters at 9600 baud carries 48 lines in a second, whatever the device wants to send."""
    for true_hz, reported in ((1000.0, 0), (1005.0, 0), (900.0, 1), (48.0, 1), (1100.0, 1)):
        events, rng = SourceEvents(), random.Random(5)
        rate = ArrivalRate(events, 1000.0)
        for number in range(int(30 * true_hz)):
            if rng.random() < 0.2:
                rate.add(number, number / true_hz + rng.random() * 0.2)  # a computer that is busy
        found = events.take()
        assert [event.kind for event in found] == ["wrong-rate"] * reported
        if reported:
            assert found[0].details["measured_hz"] == pytest.approx(true_hz, rel=0.15)


@pytest.mark.parametrize(
    ("given_keys", "code", "facts"),
    [
        ({}, "key-missing", {"keys": ["rate_hz"]}),
        ({"rate_hz": 1e3, "counter": "N"}, "value-invalid", {"key": "source.counter", "value": "N"}),
    ],
)
def test_impossible_settings_of_a_serial_line_are_refused(given_keys, code, facts):
    with refused(ConfigError, code, **facts):
        make_source(SourceSettings(**(SETTINGS | given_keys)))


@pytest.mark.parametrize("line", [b"", b"1", b"1,2,3", b"1,2x", b"\xff,\x00", b"1 000,2,5", b"1_0,2"])
def test_a_line_that_is_not_of_two_numbers_is_refused(line):
    with refused(SourceError, "line-not-numbers"):
        numbers_in(line, 2)


@pytest.mark.parametrize(("modulus", "epoch", "kind"), [(None, 3, "loss"), (1 << 16, 4, "restart")])
def test_a_run_continues_exactly_where_the_counter_does_not_wrap(tmp_path, modulus, epoch, kind):
    given = batches(40, first=2000)
    with SerialNumbersPeer(tmp_path) as peer:
        keys = peer.settings | ({} if modulus is None else {"counter_modulus": modulus})
        source = make_source(SourceSettings(**keys, timeout_s=PATIENCE_S))
        source.resume(Position(700, 3, 1500, RATE_HZ, ClockReading.at(time.monotonic())))

        def script():
            peer.wait_ready()
            for batch in given:
                peer.send(batch)

        with Feeding(script) as feeding, source:
            block = next(source.open().blocks())
            feeding.join()
            kinds = [event.kind for event in source.take_events()]
    assert block.origin.epoch == epoch
    assert block["w"][0] == 2000
    assert block.gap
    assert kind in kinds
    if modulus is None:
        assert block.start == 1200


def test_half_a_line_at_the_moment_of_unplugging_is_not_a_sample(tmp_path):
    given = batches(40)
    with SerialNumbersPeer(tmp_path) as peer:

        def script():
            peer.wait_ready()
            for batch in given[:20]:
                peer.send(batch)
            peer.write(b"2000,1")
            peer.interrupt()
            peer.write(b"000,5\n")  # the rest of a line
            for batch in given[20:]:
                peer.send(batch)

        with fed(peer, script) as source:
            found = []
            for block in source.blocks():
                found.append(block.data)
                if block["w"][-1] == given[-1].stop - 1:
                    break
            assert source.rate_hz == RATE_HZ
            assert source.channels == CHANNELS
    data = np.concatenate(found, axis=1)  # without what the device took with it
    truth = np.concatenate([batch.data for batch in given], axis=1)
    assert (np.diff(data[0]) > 0).all()
    np.testing.assert_array_equal(data, truth[:, data[0].astype(int) - given[0].first_sample])
    assert set(data[0]) >= set(truth[0, truth[0] >= given[20].first_sample])
