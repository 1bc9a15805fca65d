"""Axes compute in turns, and one that does not return does not stop the others."""

from __future__ import annotations

import threading
from pathlib import Path

from livebode.records import RunRecord
from livebode.runtime.turns import Turn
from tests.support.live_session import LiveSession, Stuck
from tests.support.peers.peer import PATIENCE_S, SAMPLES, batches, until
from tests.support.peers.plain import TcpPeer


def test_one_axis_computes_at_a_time_and_an_error_leaves_the_turn_to_the_next() -> None:
    inside, together = [], []

    def work() -> None:
        for _ in range(200):
            try:
                with Turn() as turn:
                    turn.begin()
                    turn.begin()
                    inside.append(None)
                    together.append(len(inside))
                    inside.pop()
                    raise OSError("the disk is full")
            except OSError:
                continue

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert together == [1] * 800


def test_an_axis_that_does_not_return_does_not_stop_another(tmp_path: Path) -> None:
    stuck, sent = Stuck(), batches(60, first=0)
    folders = [tmp_path / name for name in "ab"]
    for folder in folders:
        folder.mkdir()
    with TcpPeer(folders[0]) as a, TcpPeer(folders[1]) as b, LiveSession(folders[0], a, stuck):
        a.wait_ready()
        for batch in sent:
            a.send(batch)
        assert stuck.held.wait(PATIENCE_S)
        with LiveSession(folders[1], b) as other:
            b.wait_ready()
            for batch in sent:
                b.send(batch)
            until(lambda: other.control.source and not other.control.source.waiting_s, "the other axis to track")
        stuck.released.set()
    assert RunRecord.open(other.run).summary["counts"]["samples"] == 60 * SAMPLES
