"""Axes compute in turns, and one that does not return does not stop the others."""

from __future__ import annotations

import threading
from pathlib import Path

from livebode.records import RunRecord
from livebode.runtime import turns
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


def test_the_turn_goes_to_the_axis_that_has_waited_longest() -> None:
    order: list[int] = []

    def work(number: int) -> None:
        with Turn() as turn:
            turn.begin()
            order.append(number)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    with Turn() as first:
        first.begin()
        for number, thread in enumerate(threads):
            thread.start()
            until(lambda number=number: turns.waiting() == number + 1, "it to wait")
    for thread in threads:
        thread.join(PATIENCE_S)
    assert order == list(range(8))


def test_a_turn_that_was_too_long_is_passed_on_and_its_end_takes_none_from_another(monkeypatch) -> None:
    monkeypatch.setattr(turns, "TURN_S_MAX", 0.01)
    late, other, third = Turn(), Turn(), Turn()
    late.begin()
    other.begin()  # returns although the late one has not ended
    late.end()
    waits = threading.Thread(target=third.begin)
    waits.start()
    until(lambda: turns.waiting() == 1 or not waits.is_alive(), "it to wait or to be passed over")
    other.end()
    waits.join(PATIENCE_S)
    third.end()
    assert not waits.is_alive()
    assert turns.waiting() == 0


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
