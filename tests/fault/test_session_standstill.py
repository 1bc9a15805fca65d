"""A tracker that stands still while a machine sends as fast as it can: a gap and an event, and bounded memory."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import numpy as np
import pytest

from livebode.nouns import Block
from livebode.records import Run
from livebode.session import Audience, Axis, Destination, Orders, run_live
from livebode.sources.live import Batch, SourceSettings
from livebode.sources.live.inbox import INBOX_BYTES_MAX, INBOX_BYTES_MIN, INBOX_S_MAX, Inbox
from tests.peers.broker import MqttPeer
from tests.peers.peer import CHANNELS, RATE_HZ, Peer, batches, until
from tests.peers.plain import TcpPeer, UdpPeer

SIZE = 2000
"""Samples in a batch of a sender in a hurry: half a second."""
BATCHES = 400
"""200 s of the machine, three times what may wait."""
SLACK_BYTES = 64 << 20


class Stuck(Audience):
    """Holds up the thread that tracks, as a disk does that does not answer."""

    def __init__(self) -> None:
        self.held, self.released = threading.Event(), threading.Event()

    def followed(self, _: Block) -> None:
        self.held.set()
        self.released.wait()


def rss_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def hurried(count: int, first: int) -> list[Batch]:
    """Batches of half a second, numbered in their first channel."""
    found = []
    for start in range(first, first + count * SIZE, SIZE):
        data = np.stack([np.arange(start, start + SIZE, dtype=float), np.sin(0.1 * np.arange(SIZE))])
        found.append(Batch(start, data, CHANNELS, RATE_HZ, 0))
    return found


@pytest.mark.parametrize("kind", [UdpPeer, TcpPeer, MqttPeer])
def test_what_does_not_fit_is_a_gap_and_memory_is_bounded(tmp_path: Path, kind: type[Peer]) -> None:
    stuck, orders = Stuck(), Orders()
    with kind(tmp_path) as peer:
        axis = Axis.of(
            {
                "source": SourceSettings(**peer.settings).model_dump(exclude_unset=True),
                "signals": {"output": "y", "input": "w"},
                "lines": {"frequencies": "100", "window": 400},
                "tracking": {"estimator": "direct"},
                "record": {"samples": True},
            },
            "test",
        )
        to = Destination(tmp_path / "run", lambda *_: None, audience=stuck)
        session = threading.Thread(target=run_live, args=(axis, to, orders))
        session.start()
        peer.wait_ready()
        for batch in batches(12, first=0):
            peer.send(batch)
        assert stuck.held.wait(30)
        before, source = rss_bytes(), orders.source
        for batch in hurried(BATCHES, 12 * 50):
            peer.send(batch)
        until(lambda: source.health.counts["overflow"], "an overflow")
        assert source.health.waiting_bytes <= INBOX_BYTES_MAX
        grown = rss_bytes() - before
        stuck.released.set()
        until(lambda: not source.health.waiting_bytes, "the queue to be empty")
        for batch in hurried(20, 12 * 50 + BATCHES * SIZE):  # the stream goes on
            peer.send(batch)
        until(lambda: orders.source.health.lost, "the loss to be seen")
        orders.end()
        session.join()
    assert grown < INBOX_S_MAX * RATE_HZ * 2 * 8 + SLACK_BYTES
    run = Run.open(tmp_path / "run")
    kinds = [event.kind for event in run.events()]
    assert "overflow" in kinds
    assert "loss" in kinds
    assert "gap" in kinds
    assert run.summary["counts"]["missing"] == run.summary["source"]["lost"] > 0
    tables = list(run.tables("samples"))
    number, sent = (np.concatenate([t[name].to_numpy() for t in tables]) for name in ("sample", "w"))
    assert np.array_equal(sent, number + sent[0])  # each sample is the one that its number says


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
