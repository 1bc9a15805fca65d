"""A tracker that is stuck while a machine sends as fast as it can: memory is bounded, and a sender waits if it can."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from livebode.records import RunRecord, Store
from livebode.sources.live import Batch
from livebode.sources.live.inbox import INBOX_BYTES_MAX, INBOX_BYTES_MIN, INBOX_S_MAX, Inbox
from tests.support.live_session import SIZE, LiveSession, Stuck, hurried
from tests.support.peers.broker import MqttPeer
from tests.support.peers.peer import CHANNELS, PATIENCE_S, RATE_HZ, Feeding, Peer, batches, until
from tests.support.peers.plain import TcpPeer, UdpPeer

BATCHES = 150
"""75 s of the machine, more than may wait."""
SLACK_BYTES = 64 << 20


def rss_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize(
    ("cause", "advice"), [("tracking", "longer tracking.hop"), ("disk", "faster disk for the run")]
)
def test_samples_that_exceed_the_queue_become_a_gap_of_a_named_cause_and_memory_is_bounded(
    tmp_path: Path, cause: str, advice: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stuck, subscribers = Stuck(), []
    if cause == "tracking":
        subscribers.append(stuck)
    else:
        monkeypatch.setattr(Store, "commit", stuck.before(Store.commit))
    with UdpPeer(tmp_path) as peer, LiveSession(tmp_path, peer, *subscribers, record={"samples": True}) as session:
        peer.wait_ready()
        for batch in batches(12, first=0):
            peer.send(batch)
        assert stuck.held.wait(PATIENCE_S)
        before, source = rss_bytes(), session.control.source
        for batch in hurried(BATCHES, 12 * 50):
            peer.send(batch)
        until(lambda: source.health.counts["overflow"], "an overflow")
        assert source.health.waiting_bytes <= INBOX_BYTES_MAX
        grown = rss_bytes() - before
        stuck.released.set()
        until(lambda: not source.health.waiting_bytes, "the queue to be empty")
        for batch in hurried(20, 12 * 50 + BATCHES * SIZE):  # the stream goes on
            peer.send(batch)
        until(lambda: source.health.lost, "the loss to be seen")
    assert grown < INBOX_S_MAX * RATE_HZ * 2 * 8 + SLACK_BYTES
    run = RunRecord.open(tmp_path / "run")
    kinds = {event.kind: event.message for event in reversed(run.events())}
    assert advice in kinds["overflow"]
    assert advice in kinds["backlog"]
    assert "loss" in kinds
    assert "gap" in kinds
    assert run.summary["counts"]["missing"] == run.summary["source"]["lost"] > 0
    number, sent = samples(run)
    assert np.array_equal(sent, number + sent[0])  # each sample is the one that its number says


@pytest.mark.parametrize("kind", [TcpPeer, MqttPeer])
def test_a_sender_that_can_wait_loses_nothing_and_memory_is_bounded(tmp_path: Path, kind: type[Peer]) -> None:
    stuck = Stuck()

    def send() -> None:
        for batch in [*batches(12, first=0), *hurried(BATCHES, 12 * 50)]:
            peer.send(batch)

    with kind(tmp_path) as peer, LiveSession(tmp_path, peer, stuck, record={"samples": True}) as session:
        peer.wait_ready()
        with Feeding(send) as feeding:
            assert stuck.held.wait(PATIENCE_S)
            before, source = rss_bytes(), session.control.source
            until(lambda: source.waiting_s > source.queue_s_max - SIZE / RATE_HZ, "the queue to be full")
            assert source.waiting_s <= max(source.queue_s_max, 1.1 * INBOX_BYTES_MIN / (2 * 8 * RATE_HZ))
            grown = rss_bytes() - before
            stuck.released.set()
            feeding.join()
            until(lambda: source._sequencer.number == 12 * 50 + BATCHES * SIZE, "all to be tracked")
    assert grown < INBOX_S_MAX * RATE_HZ * 2 * 8 + SLACK_BYTES
    number, sent = samples(RunRecord.open(tmp_path / "run"))
    assert np.array_equal(sent, np.arange(12 * 50 + BATCHES * SIZE))
    assert np.array_equal(number, sent)


def samples(run: RunRecord) -> tuple[np.ndarray, np.ndarray]:
    """Number of each recorded sample, and the number that the sender gave it."""
    tables = list(map(pa.table, run.tables("samples")))
    return tuple(np.concatenate([t[name].to_numpy() for t in tables]) for name in ("sample", "w"))  # type: ignore[return-value]


def test_the_inbox_takes_a_minute_of_any_machine() -> None:
    def batch(samples: int, rate_hz: float) -> Batch:
        return Batch(0, np.zeros((2, samples)), CHANNELS, rate_hz)

    slow, fast, tiny = Inbox(), Inbox(), Inbox()
    while slow.put(batch(100, 4000.0), wait=False):
        pass
    assert slow.bytes == pytest.approx(INBOX_S_MAX * 40 * (100 * 16 + 1000))
    while fast.put(batch(10_000, 1e6), wait=False):
        pass
    assert INBOX_BYTES_MAX - 161_000 <= fast.bytes <= INBOX_BYTES_MAX
    while tiny.put(batch(10, 1e-3), wait=False):  # hours of a machine that hardly sends
        pass
    assert INBOX_BYTES_MIN - 2000 <= tiny.bytes <= INBOX_BYTES_MIN
    while slow.get(0.0) is not None:
        pass
    assert slow.bytes == 0
    assert slow.put(batch(100, 4000.0), wait=False)
