"""The axes of a process compute in turns, and one that does not return does not stop the others."""

from __future__ import annotations

import threading
from contextvars import ContextVar
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from livebode.records import RunRecord, Store
from livebode.runtime import Document, Subscriber, TrackerResults
from livebode.runtime.joining import Steps, WaitingSpectra
from livebode.runtime.turns import Turn
from tests.support.live_session import LiveSession, Stuck
from tests.support.peers.peer import PATIENCE_S, RATE_HZ, SAMPLES, batches, until
from tests.support.peers.plain import TcpPeer

OWN = ContextVar("of a thread", default=-1)


class Axes:
    """Threads that run a turn each, and what their steps did."""

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.errors: dict[int, BaseException] = {}
        self.turns: dict[int, Turn] = {}
        self.threads: dict[int, threading.Thread] = {}

    def begin(self, number: int, steps: Steps) -> None:
        self.threads[number] = threading.Thread(target=self._run, args=(number, steps))
        self.threads[number].start()
        until(lambda: number in self.turns, "its turn")

    def _run(self, number: int, steps: Steps) -> None:
        OWN.set(number)
        self.turns[number] = Turn(steps)
        try:
            self.turns[number].run()
        except BaseException as error:
            self.errors[number] = error

    def join(self) -> None:
        for thread in self.threads.values():
            thread.join(PATIENCE_S)
            assert not thread.is_alive()


def test_one_axis_computes_at_a_time_and_all_do_whoever_ends_first() -> None:
    axes, inside, together = Axes(), [], []

    def steps(count: int) -> Steps:
        for _ in range(count):
            inside.append(None)
            together.append(len(inside))
            inside.pop()
            yield True

    for number in range(6):
        axes.begin(number, steps(100 * (number + 1)))
    axes.join()
    assert together == [1] * 2100
    assert not axes.errors


def test_steps_are_done_in_the_order_of_asking_in_the_context_of_their_axis() -> None:
    axes, gate, order = Axes(), threading.Event(), []

    def steps(number: int) -> Steps:
        yield False
        while not gate.is_set():  # the first axis holds the turn until all have asked
            assert number == 0
            gate.wait(PATIENCE_S)
        order.append((number, OWN.get()))

    for number in range(6):
        axes.begin(number, steps(number))
    until(lambda: all(turn.stepped_s > 0 and not turn.works for turn in axes.turns.values()), "all to have begun")
    for number in (0, 4, 2, 5, 1, 3):
        axes.turns[number].ask()
        until(lambda number=number: axes.turns[number].waits or axes.turns[number].works, "it to wait")
    gate.set()
    axes.join()
    assert order == [(number, number) for number in (0, 4, 2, 5, 1, 3)]


def test_an_error_ends_its_own_axis_whoever_did_the_step() -> None:
    axes, go_on = Axes(), threading.Event()

    def fails() -> Steps:
        while not go_on.is_set():
            yield False
        raise OSError("the disk is full")

    def runs() -> Steps:
        while 1 not in axes.errors:
            yield False

    axes.begin(0, runs())
    axes.begin(1, fails())
    go_on.set()
    axes.join()
    assert list(axes.errors) == [1]
    with pytest.raises(OSError, match="the disk is full"):
        raise axes.errors[1]


def spectra(kind: object) -> WaitingSpectra:
    """What ends the step of an axis that nobody is like."""
    return WaitingSpectra(SimpleNamespace(kind=kind), SimpleNamespace(channels=(), rate_hz=1.0))  # type: ignore[arg-type]


def test_steps_that_end_at_spectra_continue_with_what_is_computed_for_all_that_wait(monkeypatch) -> None:
    axes, gate, together, answers = Axes(), threading.Event(), [], {}

    def joined(waiting: list[WaitingSpectra]) -> list[Any]:
        together.append([one.tracker.kind for one in waiting])
        return [f"of {one.tracker.kind}" for one in waiting]

    monkeypatch.setattr("livebode.runtime.turns.track_together", joined)

    def steps(number: int) -> Steps:
        yield False
        while not gate.is_set():  # the first axis holds the turn until all have asked
            gate.wait(PATIENCE_S)
        answers[number] = (yield spectra(number)), OWN.get()

    for number in range(4):
        axes.begin(number, steps(number))
    until(lambda: all(turn.stepped_s > 0 and not turn.works for turn in axes.turns.values()), "all to have begun")
    for number in (0, 3, 1, 2):
        axes.turns[number].ask()
        until(lambda number=number: axes.turns[number].waits or axes.turns[number].works, "it to wait")
    gate.set()
    axes.join()
    assert sorted(number for those in together for number in those) == [0, 1, 2, 3]
    assert answers == {number: (f"of {number}", number) for number in range(4)}
    assert not axes.errors


def test_an_axis_whose_spectra_wait_continues_where_another_does_not_return() -> None:
    axes, continued = Axes(), threading.Event()

    def waits() -> Steps:
        while 1 not in axes.turns:
            yield False
        assert (yield spectra("a")) is None
        continued.set()

    def stays() -> Steps:
        yield False
        assert continued.wait(PATIENCE_S)

    axes.begin(0, waits())
    axes.begin(1, stays())
    axes.join()
    assert not axes.errors


def test_samples_that_come_during_a_step_make_another_one_due() -> None:
    axes, asked, done = Axes(), threading.Event(), []

    def steps() -> Steps:
        axes.turns[0].ask()  # as its receiver does
        asked.set()
        yield False
        done.append(None)

    axes.begin(0, steps())
    axes.join()
    assert done == [None]


def test_an_axis_that_does_not_return_does_not_stop_another(tmp_path: Path) -> None:
    stuck, sent, reached = Stuck(), batches(60, first=0), [0]

    def follow(document: Document) -> None:
        if isinstance(document, TrackerResults):
            reached[0] = document.block.stop

    folders = [tmp_path / name for name in "ab"]
    for folder in folders:
        folder.mkdir()
    with TcpPeer(folders[0]) as a, TcpPeer(folders[1]) as b, LiveSession(folders[0], a, stuck):
        a.wait_ready()
        for batch in sent:
            a.send(batch)
        assert stuck.held.wait(PATIENCE_S)
        with LiveSession(folders[1], b, follow) as other:
            b.wait_ready()
            for batch in sent:
                b.send(batch)
            until(lambda: reached == [60 * SAMPLES], "the other axis to track")
        stuck.released.set()
    assert RunRecord.open(other.run).summary["counts"]["samples"] == 60 * SAMPLES


def test_an_axis_waits_for_its_own_disk_and_another_does_not(tmp_path: Path, monkeypatch) -> None:
    hangs, answers, commit, reached = threading.Event(), threading.Event(), Store.commit, {"a": 0, "b": 0}

    def slow(store: Store, *args: Any) -> bool:
        if store.path.parent.name == "a":
            hangs.set()
            answers.wait(PATIENCE_S)
        return commit(store, *args)

    def following(name: str) -> Subscriber:
        def take(document: Document) -> None:
            if isinstance(document, TrackerResults):
                reached[name] = document.block.stop

        return take

    monkeypatch.setattr(Store, "commit", slow)
    sent, folders = batches(200, first=0), [tmp_path / name for name in "ab"]
    for folder in folders:
        folder.mkdir()
    with TcpPeer(folders[0]) as a, TcpPeer(folders[1]) as b, LiveSession(folders[0], a, following("a")) as waiting:
        a.wait_ready()
        for batch in sent:
            a.send(batch)
        assert hangs.wait(PATIENCE_S)
        with LiveSession(folders[1], b, following("b")) as other:
            b.wait_ready()
            for batch in sent:
                b.send(batch)
            until(lambda: reached["b"] == 200 * SAMPLES, "the other axis to track")
        assert reached["a"] <= RATE_HZ
        answers.set()
        until(lambda: reached["a"] == 200 * SAMPLES, "it to track the rest")
    assert [RunRecord.open(run.run).summary["counts"]["samples"] for run in (waiting, other)] == 2 * [200 * SAMPLES]
